#pragma once
// A TOML file as a plain tree, with the line of every value.

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "terrain/base/result.h"

namespace tind::services {

struct TomlEntry;

struct TomlValue {
  using List = std::vector<TomlValue>;
  using Table = std::vector<TomlEntry>;  // in the order of its lines

  int line = 0;
  bool is_text = false;  // a scalar in quotes
  /// A scalar is the text that a flag would have: "12", "0.5", "true". Dates are no values here.
  std::variant<std::string, List, Table> value;

  const std::string* scalar() const { return std::get_if<std::string>(&value); }
  const List* list() const { return std::get_if<List>(&value); }
  const Table* table() const { return std::get_if<Table>(&value); }
};

struct TomlEntry {
  std::string key;
  TomlValue value;
};

/// The error names the file and, where the text is wrong, the line. Any bytes are safe to read:
/// what is nested more than 64 deep, by brackets and by the dots of keys, is refused.
Result<TomlValue::Table> parse_toml(std::string_view text, const std::string& file);
/// The same of a file; one longer than 1 MiB is refused.
Result<TomlValue::Table> read_toml(const std::string& file);

/// The text as a TOML string, quotes included.
std::string toml_quoted(std::string_view);

}  // namespace tind::services
