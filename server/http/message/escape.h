#pragma once
// Bytes of strangers in our log: one line stays one line.

#include <algorithm>
#include <string>
#include <string_view>

namespace tind::http {

/// Leaves out what has the form of a key, wherever it was put ("?Key=tind_..."): no log has one.
inline void hide_keys(std::string& text) {
  constexpr std::string_view kBegin = "tind_",
                             kOf =
                                 "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
  constexpr std::size_t kLeast = 40;  // characters behind it; keys have 43
  for (std::size_t at = text.find(kBegin); at != text.npos; at = text.find(kBegin, at)) {
    at += kBegin.size();
    const std::size_t end = std::min(text.find_first_not_of(kOf, at), text.size());
    if (end - at >= kLeast) text.replace(at, end - at, "...");
  }
}

/// Printable ASCII as it is; anything else, and the backslash, as \xNN. Without keys.
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
  hide_keys(out);
  return out;
}

}  // namespace tind::http
