// The library takes a level of the stack for each level of a table, when it reads it and when it
// forgets it. It stops at nested values, but not at keys of many parts (a.a.a = 1), so how deep a
// text goes is looked at first.

#include "server/services/datasets/toml_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <system_error>

namespace tind::services {
namespace {

/// What toml++ 3.3 takes for impossible is not, as fuzzing found twice.
void not_impossible(const char* what) { throw std::logic_error(what); }

}  // namespace
}  // namespace tind::services

// In every build: without assertions the compiler would go by them.
#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_ASSERT(expr) ((expr) ? void() : tind::services::not_impossible(#expr))
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

#include "terrain/base/file_io.h"

namespace tind::services {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kDeepest = 64;
constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

/// Where the string that begins at `at` ends: behind its closing quotes, else at the end of the
/// line or of the text.
std::size_t behind_string(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const bool many_lines = text.substr(at).starts_with(std::string(3, quote));
  if (!many_lines) {
    for (++at; at < text.size() && text[at] != quote && text[at] != '\n'; ++at)
      if (quote == '"' && text[at] == '\\') ++at;
    return std::min(at + 1, text.size());
  }
  std::size_t quotes = 0;  // in a row; up to two before the closing three are the string's own
  for (at += 3; at < text.size(); ++at) {
    if (text[at] == quote) {
      if (++quotes == 5) return at + 1;
      continue;
    }
    if (quotes >= 3) break;
    quotes = 0;
    if (quote == '"' && text[at] == '\\') ++at;
  }
  return std::min(at, text.size());
}

/// Whether behind some \ of a string there is other than ASCII, or behind the blanks and the ends
/// of lines that it takes away: toml++ 3.3 looks there for more of these, as outside of strings.
bool has_letter_behind_backslash(std::string_view string) {
  for (std::size_t at = string.find('\\'); at != string.npos; at = string.find('\\', at)) {
    const std::size_t next = string.find_first_not_of(" \t\r\n\v\f", ++at);
    if (next == string.npos) return false;
    if (static_cast<unsigned char>(string[next]) > 127) return true;
    at = next == at ? at + 1 : next;  // an escape is over; behind blanks there may be another
  }
  return false;
}

/// What the parser must not see.
struct Forbidden {
  int line = 0;
  std::string why;
};

/// Follows a text outside of its strings and comments: where it stands, and how deep.
class Outside {
 public:
  /// The brackets that are open, and the dots of their keys and of this one.
  std::size_t depth() const { return depth_; }
  /// Whether a quote, a bracket or a = means here what it looks like. In the middle of a value
  /// without quotes it does not: to toml++ it is a part of that, and so is what follows.
  bool may_have(char c) const {
    const bool is_quote = c == '"' || c == '\'';
    if (!is_quote && c != '[' && c != '{' && c != '=') return true;
    if (in_word_) return false;
    return !is_quote || std::string_view("\n=,[{").contains(last_) || (last_ == '.' && in_key_);
  }
  void see(char c) {
    if (c == ' ' || c == '\t' || c == '\r') return;
    last_ = c;
    if (c == '[' || c == '{') {
      open_.push_back({c, depth_++});
      in_key_ = in_key_ || c == '{';  // the [ of a header
    } else if (c == ']' || c == '}') {
      if (!open_.empty()) depth_ = open_.back().depth, open_.pop_back();
    } else if (c == ',' || c == '\n') {
      depth_ = open_.empty() ? 0 : open_.back().depth + 1;
      in_key_ = open_.empty() || (c == ',' ? open_.back().bracket == '{' : in_key_);
    } else if (c == '.') {
      ++depth_;
    } else if (c == '=') {
      in_key_ = false;
    }
    in_word_ = !in_key_ && !std::string_view("\"'=[]{},\n").contains(c);
  }

 private:
  struct Open {
    char bracket;
    std::size_t depth;  // how deep it stands
  };
  std::vector<Open> open_;
  std::size_t depth_ = 0;
  char last_ = '\n';  // but for blanks
  bool in_key_ = true;
  bool in_word_ = false;  // a value without quotes
};

/// The first line whose brackets and dots are nested more than kDeepest deep; the tree goes a few
/// times as deep at most: a key stands below its header, and a part of a header may be a list of
/// tables. Or the first with other than ASCII outside of strings and comments, which TOML has none
/// of, and which toml++ 3.3 takes for unreachable.
std::optional<Forbidden> forbidden_in(std::string_view text) {
  Outside outside;
  int line = 1;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = at;
    const char c = text[at++];
    if (!outside.may_have(c))
      return Forbidden{line, fmt::format("a {} stands in the middle of a word, or behind one", c)};
    if (c == '"' || c == '\'') {
      at = behind_string(text, begin);
      if (c == '"' && has_letter_behind_backslash(text.substr(begin, at - begin)))
        return Forbidden{line, "behind a backslash, letters other than a to z are not read"};
    } else if (c == '#') {
      at = std::min(text.find('\n', at), text.size());
    } else if (static_cast<unsigned char>(c) > 127) {
      return Forbidden{line, "letters other than a to z stand in quotes, keys as well"};
    }
    if (c != '#') outside.see(c);
    if (outside.depth() > kDeepest)
      return Forbidden{line,
                       fmt::format("is nested more than {} deep, and no settings are", kDeepest)};
    line += int(
        std::count(text.begin() + std::ptrdiff_t(begin), text.begin() + std::ptrdiff_t(at), '\n'));
  }
  return std::nullopt;
}

Result<TomlValue> value_of(const toml::node& node, const std::string& file);

Result<TomlValue::Table> table_of(const toml::table& from, const std::string& file) {
  TomlValue::Table table;
  for (const auto& [key, node] : from) {
    auto value = value_of(node, file);
    if (!value) return std::unexpected(value.error());
    table.push_back({std::string(key.str()), std::move(*value)});
  }
  std::ranges::stable_sort(table, {}, [](const TomlEntry& entry) { return entry.value.line; });
  return table;
}

Result<TomlValue> value_of(const toml::node& node, const std::string& file) {
  TomlValue made{int(node.source().begin.line), node.is_string(), std::string()};
  if (const auto* text = node.as_string()) {
    if (text->get().contains('\0'))  // a file's name would end there
      return fail(Errc::invalid_argument,
                  fmt::format("{}:{}: a text holds the character 0", file, made.line));
    made.value = text->get();
  } else if (const auto* whole = node.as_integer()) {
    made.value = std::to_string(whole->get());
  } else if (const auto* number = node.as_floating_point()) {
    made.value = fmt::format("{}", number->get());
  } else if (const auto* truth = node.as_boolean()) {
    made.value = std::string(truth->get() ? "true" : "false");
  } else if (const auto* array = node.as_array()) {
    TomlValue::List list;
    for (const toml::node& item : *array) {
      auto value = value_of(item, file);
      if (!value) return value;
      list.push_back(std::move(*value));
    }
    made.value = std::move(list);
  } else if (const auto* inner = node.as_table()) {
    auto table = table_of(*inner, file);
    if (!table) return std::unexpected(table.error());
    made.value = std::move(*table);
  } else {
    return fail(Errc::invalid_argument,
                fmt::format("{}:{}: there is no setting that takes a date", file, made.line));
  }
  return made;
}

}  // namespace

Result<TomlValue::Table> parse_toml(std::string_view text, const std::string& file) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  if (const auto wrong = forbidden_in(text))
    return fail(Errc::invalid_argument, fmt::format("{}:{}: {}", file, wrong->line, wrong->why));
  try {
    return table_of(toml::parse(text, file), file);
  } catch (const toml::parse_error& error) {
    const bool placed = error.source().begin.line > 0;
    const std::string line =
        placed ? ":" + std::to_string(error.source().begin.line) : std::string();
    return fail(Errc::invalid_argument, file + line + ": " + std::string(error.description()));
  } catch (const std::logic_error&) {
    return fail(Errc::invalid_argument, file + ": is no TOML; look for control characters");
  }
}

Result<TomlValue::Table> read_toml(const std::string& file) {
  constexpr std::uintmax_t kLongest = 1 << 20;  // bytes
  std::error_code none;
  if (fs::is_regular_file(file, none) && fs::file_size(file, none) > kLongest)
    return fail(Errc::invalid_argument, file + ": is longer than 1 MiB, and no settings are");
  const auto text = read_whole_file(file);
  if (!text) return std::unexpected(text.error());
  return parse_toml(*text, file);
}

std::string toml_quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += fmt::format("\\u{:04x}", int(c));
    } else {
      out += c;
    }
  }
  return out + '"';
}

}  // namespace tind::services
