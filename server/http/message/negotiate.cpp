#include "server/http/message/negotiate.h"

#include <algorithm>
#include <optional>

#include "server/http/message/accept_list.h"

namespace tind::http {

bool wants_gzip(const Fields& fields) {
  std::optional<int> gzip, any, identity;
  fields.each("accept-encoding", [&](std::string_view list) {
    while (!list.empty()) {
      std::string_view parameters = take_until(list, ',');
      const std::string_view coding = take_until(parameters, ';');
      const int q = weight_of(parameters);
      if (same_word(coding, "gzip") || same_word(coding, "x-gzip")) gzip = q;
      if (coding == "*") any = q;
      if (same_word(coding, "identity")) identity = q;
    }
  });
  const int q = gzip ? *gzip : any.value_or(0);
  return q > 0 && q >= identity.value_or(0);
}

bool lists_etag(std::string_view list, std::string_view etag) {
  list = without_blanks(list);
  if (list == "*") return true;
  // Entity tags may hold commas: walk from quote to quote.
  while (!list.empty()) {
    if (list.starts_with("W/")) list.remove_prefix(2);
    const std::size_t close = list.starts_with('"') ? list.find('"', 1) : list.npos;
    if (close == list.npos) return false;
    if (list.substr(0, close + 1) == etag) return true;
    list = without_blanks(list.substr(close + 1));
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
