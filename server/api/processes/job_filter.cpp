#include "server/api/processes/job_filter.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <ctime>
#include <optional>
#include <ranges>
#include <string_view>

namespace tind::api {
namespace {

constexpr double kLongest_s = 1e9;

std::vector<std::string_view> listed(std::string_view text) {
  std::vector<std::string_view> all;
  for (const auto part : std::views::split(text, ',')) all.emplace_back(part.begin(), part.end());
  return all;
}

/// The next number of exactly so many digits; takes it from the text.
std::optional<int> digits(std::string_view& text, std::size_t count) {
  int value = 0;
  if (text.size() < count) return {};
  const auto [stop, error] = std::from_chars(text.data(), text.data() + count, value);
  if (error != std::errc() || stop != text.data() + count || text[0] == '-') return {};
  text.remove_prefix(count);
  return value;
}

bool took(std::string_view& text, char c) {
  if (text.empty() || (text[0] | ('T' ^ 't')) != (c | ('T' ^ 't'))) return false;
  text.remove_prefix(1);
  return true;
}

struct Moment {
  std::int64_t first_ms = 0, last_ms = 0;  // of a day, or of a second without a fraction
};

/// RFC 3339: a date, or a time with its zone.
std::optional<Moment> moment(std::string_view text) {
  std::array<int, 6> part{};
  constexpr std::size_t kDigits[] = {4, 2, 2, 2, 2, 2};
  constexpr char kAfter[] = {'-', '-', 'T', ':', ':'};
  std::size_t known = 0;
  for (; known < part.size(); ++known) {
    const auto value = digits(text, kDigits[known]);
    if (!value) return {};
    part[known] = *value;
    if (known == 2 && text.empty()) break;
    if (known < 5 && !took(text, kAfter[known])) return {};
  }
  const auto [year, month, day, hour, minute, second] = part;
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(unsigned(month)),
                                         std::chrono::day(unsigned(day))};
  if (!date.ok() || hour > 23 || minute > 59 || second > 60) return {};
  std::tm utc{};
  utc.tm_year = year - 1900, utc.tm_mon = month - 1, utc.tm_mday = day;
  utc.tm_hour = hour, utc.tm_min = minute, utc.tm_sec = second;
  const std::int64_t start = std::int64_t(timegm(&utc)) * 1000;
  if (known == 2) return Moment{start, start + 86'400'000 - 1};
  std::int64_t fraction = 0, last = 999;
  if (took(text, '.')) {
    int places = 0;
    for (; !text.empty() && text[0] >= '0' && text[0] <= '9'; text.remove_prefix(1), ++places)
      if (places < 3) fraction = fraction * 10 + (text[0] - '0');
    if (places == 0) return {};
    for (; places < 3; ++places) fraction *= 10;
    last = fraction;
  }
  std::int64_t zone = 0;
  if (!took(text, 'Z')) {
    const bool west = !text.empty() && text[0] == '-';
    if (!west && (text.empty() || text[0] != '+')) return {};
    text.remove_prefix(1);
    const auto hours = digits(text, 2);
    if (!hours || !took(text, ':')) return {};
    const auto minutes = digits(text, 2);
    if (!minutes || *hours > 23 || *minutes > 59) return {};
    zone = (*hours * 60 + *minutes) * (west ? -60'000 : 60'000);
  }
  if (!text.empty()) return {};
  return Moment{start + fraction - zone, start + last - zone};
}

/// One moment, or two with / between, of which one may be open: nothing or "..".
std::optional<Moment> interval(std::string_view text) {
  const std::size_t slash = text.find('/');
  if (slash == text.npos) return moment(text);
  const std::string_view from = text.substr(0, slash), to = text.substr(slash + 1);
  const auto open = [](std::string_view end) { return end.empty() || end == ".."; };
  if (open(from) && open(to)) return {};
  const JobFilter all;
  const auto first = open(from) ? Moment{all.from_ms, 0} : moment(from);
  const auto last = open(to) ? Moment{0, all.to_ms} : moment(to);
  if (!first || !last || first->first_ms > last->last_ms) return {};
  return Moment{first->first_ms, last->last_ms};
}

bool is_interval(std::string_view text) { return interval(text).has_value(); }

bool are_statuses(std::string_view text) {
  return std::ranges::all_of(listed(text), [](std::string_view one) {
    return std::ranges::any_of(EnumNames<services::JobStatus>::kAll,
                               [one](const auto& status) { return one == status.second; });
  });
}

bool are_names(std::string_view text) {
  return std::ranges::none_of(listed(text), &std::string_view::empty);
}

bool are_types(std::string_view text) { return are_names(text); }

std::set<std::string, std::less<>> set_of(std::string_view text) {
  std::set<std::string, std::less<>> all;
  if (text.empty()) return all;
  for (const std::string_view one : listed(text)) all.emplace(one);
  return all;
}

}  // namespace

bool JobFilter::has(const services::Job& job, std::int64_t now_ms) const {
  if (!of_processes) return false;
  if (!processes.empty() && !processes.contains(job.process)) return false;
  if (!statuses.empty() && !statuses.contains(name_of(job.status))) return false;
  if (job.created_ms < from_ms || job.created_ms > to_ms) return false;
  if (least_s <= 0 && std::isinf(most_s)) return true;
  if (job.started_ms == 0) return false;
  const double ran_s =
      double((job.finished_ms > 0 ? job.finished_ms : now_ms) - job.started_ms) / 1000;
  return ran_s >= least_s && ran_s <= most_s;
}

std::vector<http::QueryNumber> job_filter_numbers() {
  return {{.name = "minDuration",
           .least = 0,
           .most = kLongest_s,
           .unit = "seconds",
           .about = "those that ran for so long, or have been running for it"},
          {.name = "maxDuration",
           .least = 0,
           .most = kLongest_s,
           .unit = "seconds",
           .about = "those that ran no longer"}};
}

std::vector<http::QueryWord> job_filter_words() {
  return {
      {.name = "type",
       .words = {"process"},
       .fits = are_types,
       .form = "other kinds of work with commas between, of which there is none",
       .example = "process"},
      {.name = "processID",
       .words = {},
       .fits = are_names,
       .form = "names of processes with commas between",
       .about = "the jobs of these",
       .pattern = "^[a-z-]+(,[a-z-]+)*$",
       .example = "simplify,slope"},
      {.name = "status",
       .words = {},
       .fits = are_statuses,
       .form = "accepted, running, successful, failed, dismissed, or several with commas between",
       .pattern = "^(accepted|running|successful|failed|dismissed)"
                  "(,(accepted|running|successful|failed|dismissed))*$",
       .example = "accepted,running"},
      {.name = "datetime",
       .words = {},
       .fits = is_interval,
       .form = "a date or time of RFC 3339, or two with / between, one of which may be ..",
       .about = "those that were asked for then",
       .pattern = "^20[0-9][0-9]-0[1-9]-[01][1-9](/[.][.])?$",
       .example = "2026-01-01/.."}};
}

JobFilter job_filter(const http::QueryNumbers& query) {
  JobFilter filter;
  const std::size_t numbers = query.values.size();
  filter.least_s = query.values[numbers - 2].value_or(filter.least_s);
  filter.most_s = query.values[numbers - 1].value_or(filter.most_s);
  const std::string &types = query.words[0], &when = query.words[3];
  filter.of_processes = types.empty() || set_of(types).contains("process");
  filter.processes = set_of(query.words[1]);
  filter.statuses = set_of(query.words[2]);
  if (const auto made = interval(when); made && !when.empty())
    filter.from_ms = made->first_ms, filter.to_ms = made->last_ms;
  return filter;
}

}  // namespace tind::api
