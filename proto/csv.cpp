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

/// f(field, column) of one after the other; f may move it away.
template <class F>
void each_field(std::string_view line, F&& f) {
  std::string field;
  std::size_t column = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"')
      field += '"', ++i;
    else if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      f(field, column++), field.clear();
    else
      field += c;
  }
  f(field, column);
}

enum Kind { kLon, kLat, kX, kY, kEasting, kNorthing, kE, kN, kKinds };  // by pairs, east first

/// The columns of a head line that are called after coordinates.
struct NamedColumns {
  struct Named {
    std::optional<std::size_t> column;
    std::string_view name, again;  // of another of that kind
  };
  std::array<Named, kKinds> of;
  std::size_t count = 0;  // of all columns
};

NamedColumns named_columns(std::string_view head) {
  static constexpr std::pair<std::string_view, Kind> kNames[] = {{"lon", kLon},
                                                                 {"longitude", kLon},
                                                                 {"lng", kLon},
                                                                 {"long", kLon},
                                                                 {"lat", kLat},
                                                                 {"latitude", kLat},
                                                                 {"x", kX},
                                                                 {"y", kY},
                                                                 {"easting", kEasting},
                                                                 {"e", kE},
                                                                 {"northing", kNorthing},
                                                                 {"n", kN}};
  NamedColumns found;
  each_field(head, [&](std::string& field, std::size_t column) {
    found.count = column + 1;
    const std::string own = trimmed_lower(std::move(field));
    for (const auto& [name, kind] : kNames) {
      if (name != own) continue;
      if (found.of[kind].column)
        found.of[kind].again = name;
      else
        found.of[kind] = {column, name, {}};
    }
  });
  return found;
}

std::unexpected<Error> named_twice(std::string_view one, std::string_view other) {
  return fail(Errc::bad_data, "names one coordinate twice, as " + std::string(one) + " and as " +
                                  std::string(other) + ": rename one of these columns, or leave " +
                                  "it out");
}

}  // namespace

std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> fields;
  each_field(line, [&](std::string& field, std::size_t) { fields.push_back(std::move(field)); });
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

Result<PlaceColumns> PlaceColumns::in(std::string_view head, bool degrees) {
  static constexpr Kind kOfDegrees[] = {kLon, kX, kEasting, kE},
                        kOfMetres[] = {kX, kEasting, kE, kLon};
  const NamedColumns found = named_columns(head);
  const auto has = [&](int kind) { return found.of[kind].column.has_value(); };
  const auto pair = std::ranges::find_if(degrees ? kOfDegrees : kOfMetres,
                                         [&](Kind x) { return has(x) && has(x + 1); });
  if (pair == std::end(degrees ? kOfDegrees : kOfMetres))
    return fail(Errc::bad_data, std::string("must name the columns ") + kPlaceColumns +
                                    ", with commas between them");
  const auto& x = found.of[*pair];
  const auto& y = found.of[*pair + 1];
  for (const auto& own : {x, y})
    if (!own.again.empty()) return named_twice(own.name, own.again);
  for (int kind = 0; kind < kE; ++kind)  // an e or an n may be anything
    if (has(kind) && !has(kind ^ 1))
      return named_twice((kind % 2 == 0 ? x : y).name, found.of[kind].name);
  return PlaceColumns{*x.column, *y.column, found.count};
}

PlaceFields PlaceColumns::of(std::string_view line) const {
  PlaceFields place;
  each_field(line, [&](std::string& field, std::size_t column) {
    if (column == x) place.x = number(field);
    if (column == y) place.y = number(field);
    place.count = column + 1;
  });
  return place;
}

std::string why_no_columns(std::string_view head, std::string_view names) {
  const auto ours = fields_of(names);
  std::string twice;
  each_field(head, [&](std::string& field, std::size_t) {
    if (twice.empty() && std::ranges::find(ours, field) != ours.end()) twice = field;
  });
  if (twice.empty()) return {};
  return "has a column " + twice + " already: rename it, or leave it out";
}

}  // namespace tind::csv
