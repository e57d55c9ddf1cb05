#include "server/http/message/query_numbers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "server/http/message/uri.h"
#include "terrain/base/lower_case.h"

namespace tind::http {
namespace {

constexpr std::size_t kLongestName = 64;  // of a stranger's parameter, as we repeat it

std::optional<double> number(const std::string& text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value)) return {};
  return value;
}

/// True when it is one of the words' parameters; what is wrong with it is a problem.
bool read_word(const std::string& name, const std::string& text, std::span<const QueryWord> words,
               QueryNumbers& read) {
  const auto found = std::ranges::find(words, name, &QueryWord::name);
  if (found == words.end()) return false;
  std::string& word = read.words[std::size_t(found - words.begin())];
  const auto known = std::ranges::find_if(
      found->words, [&](std::string_view one) { return lower_case(one) == lower_case(text); });
  if (!word.empty())
    read.problems.push_back({name, "given twice"});
  else if (known != found->words.end())
    word = std::string(*known);
  else if (!found->fits || !found->fits(text))
    read.problems.push_back(
        {name, fmt::format("must be {}{}{}", fmt::join(found->words, " or "),
                           found->fits && !found->words.empty() ? " or " : "", found->form)});
  else
    word = text;
  return true;
}

}  // namespace

QueryNumbers read_numbers(std::string_view query, std::span<const QueryNumber> known,
                          std::span<const QueryWord> words) {
  QueryNumbers read;
  read.values.resize(known.size());
  read.words.resize(words.size());
  const auto parameters = parse_query(query);
  if (!parameters) {
    read.problems.push_back({"query", kBadQuery});
    return read;
  }
  std::vector<bool> given(known.size());
  for (const auto& [name, text] : *parameters) {
    if (read_word(name, text, words, read)) continue;
    const auto found = std::ranges::find(known, name, &QueryNumber::name);
    if (found == known.end()) {
      read.problems.push_back(
          {name.substr(0, kLongestName), "is not a parameter of this resource"});
      continue;
    }
    const auto k = std::size_t(found - known.begin());
    const auto value = number(text);
    if (given[k])
      read.problems.push_back({name, "given twice"});
    else if (!value || *value < found->least || *value > found->most ||
             (found->whole && *value != std::floor(*value)))
      read.problems.push_back({name, fmt::format("must be {} from {:.0f} to {:.0f}", found->unit,
                                                 found->least, found->most)});
    else
      read.values[k] = value;
    given[k] = true;
  }
  return read;
}

}  // namespace tind::http
