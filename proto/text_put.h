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

/// The five characters of XML, and no control characters, which XML has no way to say.
inline std::string xml_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
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
