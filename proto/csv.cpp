#include "proto/csv.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace tind::csv {
namespace {

std::string trimmed_lower(std::string text) {
  std::erase_if(text, [](char c) { return c == ' ' || c == '\t'; });
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = char(c + 32);
  return text;
}

}  // namespace

std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"')
      fields.back() += '"', ++i;
    else if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      fields.emplace_back();
    else
      fields.back() += c;
  }
  return fields;
}

std::string field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == text.npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
  return quoted + '"';
}

bool has_open_quote(std::string_view line) { return std::ranges::count(line, '"') % 2 != 0; }

std::optional<double> number(std::string_view field) {
  const std::size_t begin = field.find_first_not_of(" \t");
  if (begin == field.npos) return {};
  field = field.substr(begin, field.find_last_not_of(" \t") + 1 - begin);
  double value = 0;
  const auto [stop, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc() || stop != field.data() + field.size() || !std::isfinite(value))
    return {};
  return value;
}

std::optional<PlaceColumns> PlaceColumns::in(std::string_view head, bool degrees) {
  using Names = std::initializer_list<std::string_view>;
  struct Pair {
    Names x, y;
  };
  const Pair geographic = {{"lon", "longitude", "lng", "long"}, {"lat", "latitude"}};
  const Pair plane[] = {{{"x"}, {"y"}}, {{"easting", "e"}, {"northing", "n"}}};
  const std::vector<std::string> names = fields_of(head);
  const auto find = [&](const Names& known, std::size_t& column) {
    for (column = 0; column < names.size(); ++column)
      if (std::ranges::find(known, trimmed_lower(names[column])) != known.end()) return true;
    return false;
  };
  PlaceColumns columns;
  const auto are = [&](const Pair& pair) {
    return find(pair.x, columns.x) && find(pair.y, columns.y);
  };
  if ((degrees && are(geographic)) || are(plane[0]) || are(plane[1]) || are(geographic))
    return columns;
  return {};
}

std::optional<std::string> filled_up(std::string line, std::size_t fields, std::size_t columns) {
  if (fields > columns) return {};
  return std::move(line.append(columns - fields, ','));
}

std::string why_no_columns(std::string_view head, std::string_view names) {
  const auto own = fields_of(head);
  for (const std::string& name : fields_of(names))
    if (std::ranges::find(own, name) != own.end())
      return "has a column " + name + " already: rename it, or leave it out";
  return {};
}

}  // namespace tind::csv
