#pragma once
// Words and numbers of text formats: for the writers of this folder.

#include <algorithm>
#include <charconv>
#include <string>
#include <string_view>

namespace tind::proto::text {

/// The shortest digits that read back as the same number.
template <class T>
void put_text(std::string& out, T value) {
  char digits[32];
  out.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

/// A comment ends with its line.
inline std::string one_line(std::string_view text) {
  std::string line(text);
  std::ranges::replace_if(
      line, [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return line;
}

/// Bytes of the character that the text begins with, in UTF-8 (RFC 3629); 0: it begins with none.
inline std::size_t utf8_bytes(std::string_view text) {
  const auto at = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
  };
  const unsigned lead = at(0), next = at(1);
  if (lead < 0x80) return 1;
  const std::size_t size = lead < 0xc2 || lead > 0xf4 ? 0 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
  for (std::size_t i = 1; i < size; ++i)
    if ((at(i) & 0xc0) != 0x80) return 0;
  const bool longer = (lead == 0xe0 && next < 0xa0) || (lead == 0xf0 && next < 0x90);
  const bool beyond = (lead == 0xed && next > 0x9f) || (lead == 0xf4 && next > 0x8f);
  return longer || beyond ? 0 : size;
}

/// The five characters of XML; no control characters, which XML has no way to say, and U+FFFD for
/// bytes that are no UTF-8.
inline std::string xml_text(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (const std::size_t bytes = utf8_bytes(text.substr(i)); bytes != 1) {
      const std::string_view whole = text.substr(i, bytes);  // U+FFFE, U+FFFF: no characters of XML
      const bool good = bytes > 0 && whole != "\xef\xbf\xbe" && whole != "\xef\xbf\xbf";
      out += good ? whole : "\xef\xbf\xbd";
      i += std::max<std::size_t>(bytes, 1) - 1;
    } else if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else if (c == '\'')
      out += "&apos;";
    else
      out += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return out;
}

}  // namespace tind::proto::text
