#include "server/api/processes/job_json.h"

#include <fmt/format.h>

#include <cctype>
#include <ctime>
#include <nlohmann/json.hpp>

#include "server/api/processes/process.h"
#include "server/services/datasets/dataset_settings.h"

namespace tind::api {

using Ordered = nlohmann::ordered_json;

namespace {

/// Of options that inputs are not called after.
struct Renamed {
  std::string_view option, input;
};
constexpr Renamed kRenamed[] = {
    {"bounds", "bbox"},    {"bounds-crs", "crs"},   {"places-crs", "crs"},
    {"to-datum", "datum"}, {"boundary", "polygon"}, {"area", "polygon"},
    {"at", "triangles"},   {"percent", "unit"},     {"max-error", "max_error"}};

/// Without an input of it: nothing.
std::string input_of(std::string_view option, const Ordered& inputs) {
  std::string name(option);
  for (char& c : name) c = c == '-' ? '_' : c;
  for (const std::string& as : {std::string(option), name})
    if (inputs.contains(as)) return as;
  for (const Renamed& renamed : kRenamed)
    if (option == renamed.option && inputs.contains(renamed.input))
      return std::string(renamed.input);
  return {};
}

}  // namespace

std::string message_of(const services::Job& job) {
  const Process* const process = process_named(job.process);
  if (!process || job.message.find("--") == job.message.npos) return job.message;
  const Ordered inputs = process->inputs();
  std::string out;
  const std::string_view text = job.message;
  for (std::size_t i = 0; i < text.size();) {
    const bool begins = text.substr(i, 2) == "--" && (i == 0 || text[i - 1] != '-');
    std::size_t end = i + (begins ? 2 : 1);
    while (begins && end < text.size() &&
           (std::isalnum((unsigned char)text[end]) || text[end] == '-'))
      ++end;
    const std::string_view word = text.substr(i, end - i), option = begins ? word.substr(2) : "";
    const std::string input = option.empty() ? "" : input_of(option, inputs);
    if (!input.empty())
      out += input;
    else if (!option.empty() && services::dataset_setting(option))
      out += "the dataset's setting " + std::string(option);
    else
      out += word;
    i = end;
  }
  return out;
}

std::string time_text(std::int64_t ms) {
  const std::time_t seconds = ms / 1000;
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", utc.tm_year + 1900,
                     utc.tm_mon + 1, utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec, ms % 1000);
}

Ordered link_json(const std::string& href, const char* rel, const std::string& type,
                  const std::string& title) {
  Ordered link = {{"href", href}, {"rel", rel}, {"type", type}};
  if (!title.empty()) link["title"] = title;
  return link;
}

Ordered status_json(const services::Job& job, const std::string& origin) {
  Ordered json = {{"jobID", job.id},
                  {"processID", job.process},
                  {"type", "process"},
                  {"status", name_of(job.status)},
                  {"message", message_of(job)},
                  {"progress", job.progress},
                  {"created", time_text(job.created_ms)}};
  if (job.started_ms > 0) json["started"] = time_text(job.started_ms);
  if (job.finished_ms > 0) json["finished"] = time_text(job.finished_ms);
  json["updated"] = time_text(job.updated_ms);
  const std::string self = origin + "/jobs/" + job.id;
  json["links"] = Ordered::array({link_json(self, "self", "application/json", "this job")});
  if (job.status == services::JobStatus::successful) {
    json["links"].push_back(link_json(self + "/results",
                                      "http://www.opengis.net/def/rel/ogc/1.0/results",
                                      "application/json", "all results"));
    for (const services::JobOrder::Output& o : order_of(job).outputs)
      json["links"].push_back(link_json(self + "/results/" + o.name, "item", o.media_type, o.name));
  }
  return json;
}

}  // namespace tind::api
