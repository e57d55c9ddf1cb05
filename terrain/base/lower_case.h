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

}  // namespace tind
