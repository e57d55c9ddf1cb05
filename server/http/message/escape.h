#pragma once
// Bytes of strangers in our log: one line stays one line.

#include <string>
#include <string_view>

namespace tind::http {

/// Printable ASCII as it is; anything else, and the backslash, as \xNN.
inline std::string escaped(std::string_view text) {
  constexpr char kHex[] = "0123456789abcdef";
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte < 0x7f && c != '\\') {
      out += c;
    } else {
      out += {'\\', 'x', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return out;
}

}  // namespace tind::http
