#include "server/cli/options/trajectory_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

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

/// Seconds since 1970 of 2026-01-31T12:00:00[.5][Z].
std::optional<double> date(std::string_view s) {
  if (s.ends_with('Z')) s.remove_suffix(1);
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
  return 86400.0 * double(days) + 3600.0 * hour + 60.0 * minute + *second;
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
  static constexpr std::array<std::pair<const char*, Column>, 16> kNames = {{{"lon", kLon},
                                                                             {"longitude", kLon},
                                                                             {"x", kLon},
                                                                             {"lat", kLat},
                                                                             {"latitude", kLat},
                                                                             {"y", kLat},
                                                                             {"height", kHeight},
                                                                             {"height_m", kHeight},
                                                                             {"altitude", kHeight},
                                                                             {"alt", kHeight},
                                                                             {"ele", kHeight},
                                                                             {"z", kHeight},
                                                                             {"time", kTime},
                                                                             {"time_s", kTime},
                                                                             {"timestamp", kTime},
                                                                             {"t", kTime}}};
  for (const auto& [known, column] : kNames)
    if (name == known) return column;
  return {};
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> out;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = std::min(line.find_first_of(",;", at), line.size());
    out.push_back(trimmed(line.substr(at, end - at)));
    at = end + 1;
  }
  return out;
}

Result<Fixes> read_csv(std::string_view text) {
  constexpr std::size_t kAbsent = ~std::size_t(0);
  std::array<std::size_t, kColumns> at = {0, 1, 2, 3};
  Fixes out;
  std::size_t line_number = 0;
  bool first = true;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = trimmed(text.substr(begin, end - begin));
    begin = end + 1;
    ++line_number;
    if (line.empty() || line[0] == '#') continue;
    const auto cells = cells_of(line);
    const std::string where = "line " + std::to_string(line_number);
    if (std::exchange(first, false)) {
      if (!number(cells[0])) {
        at.fill(kAbsent);
        for (std::size_t i = 0; i < cells.size(); ++i)
          if (const auto c = column_of(std::string(cells[i])); c && at[*c] == kAbsent) at[*c] = i;
        if (at[kLon] == kAbsent || at[kLat] == kAbsent)
          return wrong(where + ": no columns named lon and lat");
        continue;
      }
      for (std::size_t& i : at)
        if (i >= cells.size()) i = kAbsent;
    }
    std::array<double, 3> v{};
    for (const Column c : {kLon, kLat, kHeight}) {
      if (at[c] == kAbsent) continue;
      const auto n = at[c] < cells.size() ? number(cells[at[c]]) : std::nullopt;
      if (!n) return wrong(where + ": column " + std::to_string(at[c] + 1) + " is no number");
      v[c] = *n;
    }
    out.flight.push_back({{v[kLon], v[kLat]}, v[kHeight], 0});
    if (out.flight.size() > kMostFixes) return wrong("more than a million fixes");
    if (at[kTime] == kAbsent) continue;
    if (at[kTime] >= cells.size()) return wrong(where + " has no time");
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

double metres(const FlightFix& a, const FlightFix& b) {
  const Vec2 degree = wgs84::metres_per_degree(a.where.lat);
  return std::hypot(std::remainder(b.where.lon - a.where.lon, 360) * degree.x,
                    (b.where.lat - a.where.lat) * degree.y, b.height_m - a.height_m);
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
