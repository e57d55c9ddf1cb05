#pragma once
// Words and numbers of text formats, without copying: for the readers of this folder.

#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <system_error>

namespace tind::proto::text {

inline bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

/// Takes the next word off the front; empty when there is none. Newlines separate too.
inline std::string_view take_word(std::string_view& rest) {
  std::size_t begin = 0;
  while (begin < rest.size() && (is_blank(rest[begin]) || rest[begin] == '\n')) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !is_blank(rest[end]) && rest[end] != '\n') ++end;
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return word;
}

inline std::string_view trim(std::string_view s) {
  while (!s.empty() && (is_blank(s.front()) || s.front() == '\n')) s.remove_prefix(1);
  while (!s.empty() && (is_blank(s.back()) || s.back() == '\n')) s.remove_suffix(1);
  return s;
}

/// The whole word as a number, in any locale; a leading '+' is allowed.
template <class T>
bool parse(std::string_view word, T& out) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), out);
  return code == std::errc() && end == word.data() + word.size();
}

/// A finite number.
inline bool parse_finite(std::string_view word, double& out) {
  return parse(word, out) && std::isfinite(out);
}

/// Lines one after the other, with their numbers from 1, whichever way they end (LF, CR LF, CR). A
/// byte order mark at the beginning is none of them. With `at_backslash` one at a line's end joins
/// the next, as OBJ has it; not at the end of a comment, where it is that of a path.
class Lines {
 public:
  enum class Join { never, at_backslash };
  explicit Lines(std::string_view text, Join join = Join::never) : rest_(text), join_(join) {
    if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
  }

  bool next(std::string_view& line) {
    if (!take(line)) return false;
    first_ = last_;
    if (join_ == Join::never || !line.ends_with('\\') || trim(line).starts_with('#')) return true;
    joined_.assign(line);
    while (joined_.ends_with('\\')) {
      joined_.back() = ' ';
      if (!take(line)) break;
      joined_ += line;
    }
    line = joined_;
    return true;
  }
  std::size_t number() const { return first_; }

 private:
  bool take(std::string_view& line) {
    if (rest_.empty()) return false;
    const std::size_t end = rest_.find_first_of("\r\n");
    line = rest_.substr(0, end);
    const bool two = end != rest_.npos && rest_.substr(end).starts_with("\r\n");
    rest_.remove_prefix(end == rest_.npos ? rest_.size() : end + 1 + std::size_t(two));
    ++last_;
    return true;
  }

  std::string_view rest_;
  Join join_;
  std::string joined_;
  std::size_t first_ = 0, last_ = 0;
};

}  // namespace tind::proto::text
