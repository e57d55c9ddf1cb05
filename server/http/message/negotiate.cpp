#include "server/http/message/negotiate.h"

#include <algorithm>
#include <optional>

namespace tind::http {
namespace {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

std::string_view cut(std::string_view& text, char separator) {
  const std::string_view part = text.substr(0, text.find(separator));
  text.remove_prefix(std::min(part.size() + 1, text.size()));
  return trimmed(part);
}

bool same(std::string_view text, std::string_view lower) {
  return std::ranges::equal(
      text, lower, [](char a, char b) { return (a >= 'A' && a <= 'Z' ? char(a + 32) : a) == b; });
}

/// "0", "0.5", "1.000" in thousandths; anything else is no weight at all, and counts as 0.
int thousandths(std::string_view q) {
  if (q.empty() || q.size() > 5 || (q[0] != '0' && q[0] != '1')) return 0;
  if (q.size() > 1 && q[1] != '.') return 0;
  int value = q[0] == '1' ? 1000 : 0, digit = 100;
  for (const char c : q.substr(std::min<std::size_t>(2, q.size()))) {
    if (c < '0' || c > '9') return 0;
    value += (c - '0') * digit;
    digit /= 10;
  }
  return std::min(value, 1000);
}

int weight(std::string_view parameters) {
  while (!parameters.empty()) {
    const std::string_view parameter = cut(parameters, ';');
    if (parameter.size() >= 2 && (parameter[0] == 'q' || parameter[0] == 'Q') &&
        parameter[1] == '=')
      return thousandths(parameter.substr(2));
  }
  return 1000;
}

}  // namespace

bool wants_gzip(const Fields& fields) {
  std::optional<int> gzip, any, identity;
  fields.each("accept-encoding", [&](std::string_view list) {
    while (!list.empty()) {
      std::string_view parameters = cut(list, ',');
      const std::string_view coding = cut(parameters, ';');
      const int q = weight(parameters);
      if (same(coding, "gzip") || same(coding, "x-gzip")) gzip = q;
      if (coding == "*") any = q;
      if (same(coding, "identity")) identity = q;
    }
  });
  const int q = gzip ? *gzip : any.value_or(0);
  return q > 0 && q >= identity.value_or(0);
}

bool lists_etag(std::string_view list, std::string_view etag) {
  list = trimmed(list);
  if (list == "*") return true;
  // Entity tags may hold commas: walk from quote to quote.
  while (!list.empty()) {
    if (list.starts_with("W/")) list.remove_prefix(2);
    const std::size_t close = list.starts_with('"') ? list.find('"', 1) : list.npos;
    if (close == list.npos) return false;
    if (list.substr(0, close + 1) == etag) return true;
    list = trimmed(list.substr(close + 1));
    if (!list.empty() && list.front() != ',') return false;
    while (!list.empty() && (list.front() == ',' || list.front() == ' ')) list.remove_prefix(1);
  }
  return false;
}

Conditions::Conditions(const Fields& fields) : gzip(wants_gzip(fields)) {
  fields.each("if-none-match", [&](std::string_view value) {
    if (!none_match.empty()) none_match += ", ";
    none_match += value;
  });
  int ranges = 0;
  fields.each("range", [&](std::string_view value) { range = value, ++ranges; });
  if (ranges > 1) range.clear();
  fields.each("if-range", [&](std::string_view value) { if_range = value; });
}

}  // namespace tind::http
