#pragma once
// The elements of fields such as Accept and Accept-Encoding, with their weights (RFC 9110, 12.4.2).

#include <algorithm>
#include <string_view>

namespace tind::http {

inline std::string_view without_blanks(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

/// What stands before the separator, which goes with it.
inline std::string_view take_until(std::string_view& text, char separator) {
  const std::string_view part = text.substr(0, text.find(separator));
  text.remove_prefix(std::min(part.size() + 1, text.size()));
  return without_blanks(part);
}

/// In any case. `lower`: in small letters.
inline bool same_word(std::string_view text, std::string_view lower) {
  return std::ranges::equal(
      text, lower, [](char a, char b) { return (a >= 'A' && a <= 'Z' ? char(a + 32) : a) == b; });
}

/// "0", "0.5", "1.000" in thousandths; anything else is no weight at all, and counts as 0.
inline int thousandths(std::string_view q) {
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

/// The q of an element's parameters, in thousandths; 1000 without one.
inline int weight_of(std::string_view parameters) {
  while (!parameters.empty()) {
    const std::string_view parameter = take_until(parameters, ';');
    if (parameter.size() >= 2 && (parameter[0] == 'q' || parameter[0] == 'Q') &&
        parameter[1] == '=')
      return thousandths(parameter.substr(2));
  }
  return 1000;
}

}  // namespace tind::http
