#pragma once
// Texts of others, as much of them as is shown.

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace tind {

/// The beginning, of so many bytes at most, and in UTF-8 no part of a character.
inline std::string_view short_text(std::string_view text, std::size_t most) {
  std::size_t end = std::min(most, text.size());
  const auto continues = [&](std::size_t i) {
    return (static_cast<unsigned char>(text[i]) & 0xC0) == 0x80;
  };
  while (end > 0 && end < text.size() && continues(end)) --end;
  return text.substr(0, end);
}

}  // namespace tind
