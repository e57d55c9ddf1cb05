#include "server/http/message/byte_range.h"

#include <strings.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>
#include <system_error>

namespace tind::http {
namespace {

constexpr std::string_view kUnit = "bytes=";

/// Digits only; a number too large for any body is as good as the largest.
std::optional<std::size_t> whole_number(std::string_view text) {
  if (text.empty() || text.find_first_not_of("0123456789") != text.npos) return {};
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() ? value : std::numeric_limits<std::size_t>::max();
}

}  // namespace

AskedRange asked_range(std::string_view field, std::size_t size) {
  using Kind = AskedRange::Kind;
  if (field.size() <= kUnit.size() || strncasecmp(field.data(), kUnit.data(), kUnit.size()) != 0)
    return {};
  field.remove_prefix(kUnit.size());
  const std::size_t dash = field.find('-');
  if (dash == field.npos) return {};
  const auto first = whole_number(field.substr(0, dash)),
             last = whole_number(field.substr(dash + 1));
  if (dash == 0) {  // the last so many
    if (!last) return {};
    if (*last == 0 || size == 0) return {Kind::beyond};
    const std::size_t count = std::min(*last, size);
    return {Kind::part, size - count, count};
  }
  const bool open = dash + 1 == field.size();
  if (!first || (!open && !last) || (last && *last < *first)) return {};
  if (*first >= size) return {Kind::beyond};
  return {Kind::part, *first, std::min(open ? size - 1 : *last, size - 1) - *first + 1};
}

}  // namespace tind::http
