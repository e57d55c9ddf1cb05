#include "server/cli/options/trajectory_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "proto/csv.h"
#include "proto/json_text.h"
#include "terrain/base/lower_case.h"
#include "terrain/geo/ellipsoid.h"

namespace tind::cli {

namespace {

using Json = nlohmann::json;
constexpr std::size_t kMostFixes = 1000000;

std::unexpected<Error> wrong(const std::string& what) { return fail(Errc::invalid_argument, what); }

std::string_view trimmed(std::string_view s) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '"'; };
  while (!s.empty() && blank(s.front())) s.remove_prefix(1);
  while (!s.empty() && blank(s.back())) s.remove_suffix(1);
  return s;
}

std::optional<double> number(std::string_view s) {
  double v = 0;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), v);
  if (error != std::errc() || end != s.data() + s.size() || !std::isfinite(v)) return {};
  return v;
}

/// Seconds that +01:00 at the end of a time is ahead of UTC, which are taken off; 0 of Z, and of
/// what says nothing.
std::optional<double> take_offset(std::string_view& s) {
  if (s.ends_with('Z')) return s.remove_suffix(1), 0;
  const std::size_t at = s.find_last_of("+-");
  if (at == s.npos || at < 19) return 0;  // within the date
  const std::string_view said = s.substr(at);
  const auto digit = [&](std::size_t i) { return said[i] >= '0' && said[i] <= '9'; };
  if (said.size() != 6 || said[3] != ':' || !digit(1) || !digit(2) || !digit(4) || !digit(5))
    return {};
  const int hours = (said[1] - '0') * 10 + said[2] - '0';
  const int minutes = (said[4] - '0') * 10 + said[5] - '0';
  if (hours > 23 || minutes > 59) return {};
  s = s.substr(0, at);
  return (said[0] == '-' ? -60.0 : 60.0) * (60 * hours + minutes);
}

/// Seconds since 1970 of 2026-01-31T12:00:00[.5][Z or +01:00].
std::optional<double> date(std::string_view s) {
  const auto ahead = take_offset(s);
  if (!ahead) return {};
  if (s.size() < 19 || s[4] != '-' || s[7] != '-' || (s[10] != 'T' && s[10] != ' ') ||
      s[13] != ':' || s[16] != ':')
    return {};
  const auto part = [&](std::size_t at, std::size_t n) {
    int v = -1;
    const char* const end = s.data() + at + n;
    const auto [stop, error] = std::from_chars(s.data() + at, end, v);
    return error == std::errc() && stop == end ? v : -1;
  };
  const int hour = part(11, 2), minute = part(14, 2);
  const auto second = number(s.substr(17));
  const std::chrono::year_month_day day{std::chrono::year(part(0, 4)),
                                        std::chrono::month(unsigned(part(5, 2))),
                                        std::chrono::day(unsigned(part(8, 2)))};
  if (!day.ok() || hour < 0 || hour > 23 || minute < 0 || minute > 59 || !second ||
      !(*second >= 0 && *second < 61))
    return {};
  const auto days = std::chrono::sys_days(day).time_since_epoch().count();
  return 86400.0 * double(days) + 3600.0 * hour + 60.0 * minute + *second - *ahead;
}

/// Fixes as a file has them: any may be without a time, or all.
struct Fixes {
  std::vector<FlightFix> flight;
  std::vector<double> times;
  bool dates = false;
};

Result<void> add_time(Fixes& out, std::string_view text, const std::string& where) {
  auto t = number(text);
  if (!t) {
    t = date(text);
    if (!t) return wrong(where + ": '" + std::string(text.substr(0, 40)) + "' is no time");
    if (!out.dates && !out.times.empty()) return wrong(where + ": a date after seconds");
    out.dates = true;
  } else if (out.dates) {
    return wrong(where + ": seconds after a date");
  }
  out.times.push_back(*t);
  return {};
}

// ---- CSV ----

enum Column { kLon, kLat, kHeight, kTime, kColumns };

std::optional<Column> column_of(std::string_view said) {
  const std::string name = lower_case(said);
  static constexpr std::pair<const char*, Column> kNames[] = {{"lon", kLon},
                                                              {"longitude", kLon},
                                                              {"x", kLon},
                                                              {"lat", kLat},
                                                              {"latitude", kLat},
                                                              {"y", kLat},
                                                              {"height", kHeight},
                                                              {"height_m", kHeight},
                                                              {"altitude", kHeight},
                                                              {"altitude_m", kHeight},
                                                              {"alt", kHeight},
                                                              {"alt_m", kHeight},
                                                              {"elevation", kHeight},
                                                              {"elevation_m", kHeight},
                                                              {"ele", kHeight},
                                                              {"z", kHeight},
                                                              {"time", kTime},
                                                              {"time_s", kTime},
                                                              {"timestamp", kTime},
                                                              {"t", kTime}};
  for (const auto& [known, column] : kNames)
    if (name == known) return column;
  return {};
}

/// Of commas, or of semicolons where the file has these: then a comma is within a cell.
std::vector<std::string> cells_of(std::string_view line, bool semicolons) {
  std::vector<std::string> out;
  if (!semicolons) {
    out = csv::fields_of(line);
  } else {
    for (std::size_t at = 0; at <= line.size();) {
      const std::size_t end = std::min(line.find(';', at), line.size());
      out.emplace_back(line.substr(at, end - at));
      at = end + 1;
    }
  }
  for (std::string& cell : out) cell = std::string(trimmed(cell));
  return out;
}

constexpr std::size_t kAbsent = ~std::size_t(0);
using Columns = std::array<std::size_t, kColumns>;

/// By the names of a head line. x, y and z beside lon, lat and a height may be in any system, and a
/// flight is in degrees and metres. Times may be there twice: in another form, as a rule.
Result<Columns> named_columns(const std::vector<std::string>& names) {
  Columns at;
  at.fill(kAbsent);
  std::string other;
  const auto is_of_any_system = [&](std::size_t i) {
    const std::string name = lower_case(names[i]);
    return name == "x" || name == "y" || name == "z";
  };
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto column = column_of(names[i]);
    if (!column) {
      other += (other.empty() ? "" : ", ") + names[i];
      continue;
    }
    std::size_t& had = at[*column];
    if (had == kAbsent || (is_of_any_system(had) && !is_of_any_system(i)))
      had = i;
    else if (*column != kTime && is_of_any_system(had) == is_of_any_system(i))
      return wrong("two columns say the same, " + names[had].substr(0, 40) + " and " +
                   names[i].substr(0, 40) + ": rename one of them, or leave it out");
  }
  if (at[kLon] == kAbsent || at[kLat] == kAbsent) return wrong("no columns named lon and lat");
  if (at[kHeight] == kAbsent && !other.empty())
    return wrong(
        "no column named height, altitude or elevation (metres), and none of these is known: " +
        other.substr(0, 100));
  return at;
}

Result<Fixes> read_csv(std::string_view text) {
  Columns at = {0, 1, 2, 3};
  Fixes out;
  std::size_t line_number = 0, columns = 0;
  bool semicolons = false;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = text.substr(begin, end - begin);
    begin = end + 1;
    ++line_number;
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (trimmed(line).empty() || line[0] == '#') continue;
    const std::string where = "line " + std::to_string(line_number);
    if (csv::has_open_quote(line)) return wrong(where + " " + csv::kOpenQuote);
    if (columns == 0) semicolons = line.find(';') != line.npos;
    const auto cells = cells_of(line, semicolons);
    if (columns == 0) {
      columns = cells.size();
      if (!number(cells[0])) {
        const auto named = named_columns(cells);
        if (!named) return wrong(where + ": " + named.error().what);
        at = *named;
        continue;
      }
      for (std::size_t& i : at)
        if (i >= columns) i = kAbsent;
      if (at[kLat] == kAbsent) return wrong(where + " is not lon,lat,height,time");
    }
    if (cells.size() != columns)
      return wrong(where + " has " + std::to_string(cells.size()) + " columns, the first has " +
                   std::to_string(columns));
    std::array<double, 3> v{};
    for (const Column c : {kLon, kLat, kHeight}) {
      if (at[c] == kAbsent) continue;
      const auto n = number(cells[at[c]]);
      if (!n) return wrong(where + ": column " + std::to_string(at[c] + 1) + " is no number");
      v[c] = *n;
    }
    out.flight.push_back({{v[kLon], v[kLat]}, v[kHeight], 0});
    if (out.flight.size() > kMostFixes) return wrong("more than a million fixes");
    if (at[kTime] == kAbsent) continue;
    if (auto ok = add_time(out, cells[at[kTime]], where); !ok) return std::unexpected(ok.error());
  }
  return out;
}

// ---- GeoJSON ----

Result<Fixes> read_line(const Json& geometry, const Json& properties) {
  if (!geometry.is_object() || geometry.value("type", Json()) != "LineString")
    return wrong("the GeoJSON has no LineString");
  const Json coordinates = geometry.value("coordinates", Json());
  if (!coordinates.is_array() || coordinates.size() > kMostFixes)
    return wrong("the LineString has no coordinates, or too many");
  Fixes out;
  for (const Json& c : coordinates) {
    const std::string where = "fix " + std::to_string(out.flight.size());
    if (!c.is_array() || c.size() < 2 || c.size() > 4 ||
        !std::ranges::all_of(c, [](const Json& n) { return n.is_number(); }))
      return wrong(where + " must be [lon, lat, height] or [lon, lat, height, time]");
    out.flight.push_back(
        {{c[0].get<double>(), c[1].get<double>()}, c.size() > 2 ? c[2].get<double>() : 0, 0});
    if (c.size() == 4) out.times.push_back(c[3].get<double>());
  }
  for (const char* key : {"times", "coordTimes"}) {
    if (!properties.is_object() || !properties.contains(key)) continue;
    if (!out.times.empty()) return wrong("the times are there twice");
    const Json& times = properties[key];
    if (!times.is_array()) return wrong("\"" + std::string(key) + "\" is no list");
    for (const Json& t : times) {
      const std::string where = std::string(key) + " " + std::to_string(out.times.size());
      if (!t.is_number() && !t.is_string()) return wrong(where + " is no time");
      if (auto ok = add_time(out, t.is_string() ? t.get<std::string>() : t.dump(), where); !ok)
        return std::unexpected(ok.error());
    }
  }
  return out;
}

Result<Fixes> read_geojson(std::string_view text) {
  Json json = json::parse<Json>(text);
  if (json.is_discarded() || !json.is_object()) return wrong("the GeoJSON is no JSON object");
  if (json.value("type", Json()) == "FeatureCollection") {
    const Json features = json.value("features", Json());
    if (!features.is_array() || features.size() != 1)
      return wrong("the FeatureCollection must have one feature, the flight");
    json = features[0];
  }
  if (json.is_object() && json.value("type", Json()) == "Feature")
    return read_line(json.value("geometry", Json()), json.value("properties", Json()));
  return read_line(json, Json());
}

/// Along the way that is flown, a straight line of degrees, whose metres change with the latitude.
double metres(const FlightFix& a, const FlightFix& b) {
  const double lon = std::remainder(b.where.lon - a.where.lon, 360);
  const double lat = b.where.lat - a.where.lat;
  const int parts = std::max(1, int(std::ceil(std::abs(lat))));
  double sum = 0;
  for (int k = 0; k < parts; ++k) {
    const Vec2 degree = wgs84::metres_per_degree(a.where.lat + lat * (k + 0.5) / parts);
    sum += std::hypot(lon / parts * degree.x, lat / parts * degree.y,
                      (b.height_m - a.height_m) / parts);
  }
  return sum;
}

}  // namespace

Result<std::vector<FlightFix>> parse_trajectory(std::string_view text,
                                                std::optional<double> speed) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // a byte order mark
  const std::size_t start = text.find_first_not_of(" \t\r\n");
  const bool json = start != text.npos && text[start] == '{';
  auto read = json ? read_geojson(text) : read_csv(text);
  if (!read) return std::unexpected(read.error());
  std::vector<FlightFix>& flight = read->flight;
  if (flight.empty()) return wrong("there is no fix in it");
  for (std::size_t i = 0; i < flight.size(); ++i)
    if (!(std::abs(flight[i].where.lon) <= 360 && std::abs(flight[i].where.lat) <= 90 &&
          std::abs(flight[i].height_m) <= 1e8))
      return wrong("fix " + std::to_string(i) + " is not on earth");
  if (!read->times.empty()) {
    if (speed) return wrong("the flight has times, so it needs no speed");
    if (read->times.size() != flight.size())
      return wrong(std::to_string(flight.size()) + " fixes, but " +
                   std::to_string(read->times.size()) + " times");
    const double zero = read->dates ? read->times[0] : 0;
    for (std::size_t i = 0; i < flight.size(); ++i) flight[i].time_s = read->times[i] - zero;
  } else if (flight.size() > 1) {
    if (!speed || !(*speed > 0 && *speed <= 1e5))
      return wrong("the flight has no times: give its speed, 0 to 100000 m/s");
    for (std::size_t i = 1; i < flight.size(); ++i)
      flight[i].time_s = flight[i - 1].time_s + metres(flight[i - 1], flight[i]) / *speed;
  }
  return std::move(flight);
}

}  // namespace tind::cli
