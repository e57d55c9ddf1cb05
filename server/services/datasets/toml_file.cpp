#include "server/services/datasets/toml_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>

namespace tind::services {
namespace {

Result<TomlValue> value_of(const toml::node& node, const std::string& file);

Result<TomlValue::Table> table_of(const toml::table& from, const std::string& file) {
  TomlValue::Table table;
  for (const auto& [key, node] : from) {
    auto value = value_of(node, file);
    if (!value) return std::unexpected(value.error());
    table.emplace_back(std::string(key.str()), std::move(*value));
  }
  std::ranges::stable_sort(table, {}, [](const auto& entry) { return entry.second.line; });
  return table;
}

Result<TomlValue> value_of(const toml::node& node, const std::string& file) {
  TomlValue made{int(node.source().begin.line), node.is_string(), std::string()};
  if (const auto* text = node.as_string()) {
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

Result<TomlValue::Table> read_toml(const std::string& file) {
  try {
    return table_of(toml::parse_file(file), file);
  } catch (const toml::parse_error& error) {
    const bool placed = error.source().begin.line > 0;
    const std::string line =
        placed ? ":" + std::to_string(error.source().begin.line) : std::string();
    return fail(Errc::invalid_argument, file + line + ": " + std::string(error.description()));
  }
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
