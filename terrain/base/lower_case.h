#pragma once
// Names that count in any case: endings of files, keywords, units.

#include <string>
#include <string_view>

namespace tind {

/// ASCII's letters as small ones, in whatever locale; all else as it is.
inline std::string lower_case(std::string_view text) {
  std::string low(text);
  for (char& c : low)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return low;
}

/// The other way.
inline std::string upper_case(std::string_view text) {
  std::string up(text);
  for (char& c : up)
    if (c >= 'a' && c <= 'z') c = char(c - 'a' + 'A');
  return up;
}

}  // namespace tind
