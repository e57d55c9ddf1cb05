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

namespace {

bool lists(std::string_view list, std::string_view etag, bool strongly) {
  list = without_blanks(list);
  if (list == "*") return true;
  // Entity tags may hold commas: walk from quote to quote.
  while (!list.empty()) {
    const bool weak = list.starts_with("W/");
    if (weak) list.remove_prefix(2);
    const std::size_t close = list.starts_with('"') ? list.find('"', 1) : list.npos;
    if (close == list.npos) return false;
    if (!(weak && strongly) && list.substr(0, close + 1) == etag) return true;
    list = without_blanks(list.substr(close + 1));
    if (!list.empty() && list.front() != ',') return false;
    while (!list.empty() && (list.front() == ',' || list.front() == ' ')) list.remove_prefix(1);
  }
  return false;
}

/// The values of all fields of that name as one list.
std::string all_of(const Fields& fields, std::string_view name) {
  std::string list;
  fields.each(name, [&](std::string_view value) {
    if (!list.empty()) list += ", ";
    list += value;
  });
  return list;
}

}  // namespace

bool lists_etag(std::string_view list, std::string_view etag) { return lists(list, etag, false); }
bool lists_strong_etag(std::string_view list, std::string_view etag) {
  return lists(list, etag, true);
}

Conditions::Conditions(const Fields& fields)
    : gzip(wants_gzip(fields)),
      match(all_of(fields, "if-match")),
      none_match(all_of(fields, "if-none-match")) {
  int ranges = 0;
  fields.each("range", [&](std::string_view value) { range = value, ++ranges; });
  if (ranges > 1) range.clear();
  fields.each("if-range", [&](std::string_view value) { if_range = value; });
}

Conditions::Conditions(const RequestHead& head) : Conditions(head.fields) {
  if (head.method != Method::get) range.clear();  // RFC 9110, 14.2
}

bool Conditions::excludes(std::string_view etag, std::string_view gzip_etag) const {
  return !match.empty() && !lists_strong_etag(match, etag) &&
         (gzip_etag.empty() || !lists_strong_etag(match, gzip_etag));
}

}  // namespace tind::http
