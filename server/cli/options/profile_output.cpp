#include "server/cli/options/profile_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "proto/json_text.h"
#include "terrain/base/lower_extension.h"
#include "terrain/geo/line_parts.h"

namespace tind::cli {
namespace {

using Ordered = nlohmann::ordered_json;

const char* word(Coverage coverage) {
  return coverage == Coverage::value ? "value" : coverage == Coverage::void_ ? "void" : "outside";
}

bool has_height(const ProfilePoint& p) { return p.height.coverage == Coverage::value; }

/// To a micrometre, or 1e-11 degrees: what lies below is rounding.
double metres(double v) { return std::round(v * 1e6) / 1e6; }
double degrees(double v) { return std::round(v * 1e11) / 1e11; }

Ordered height_json(const ProfilePoint& p, double by = 0) {
  if (!has_height(p)) return nullptr;
  return metres(p.height.height_m + by);
}

std::string csv_text(const Profile& profile, const ProfileFacts& facts) {
  std::string text = "distance_m,lon,lat,height_m";
  text += facts.bound_m ? ",low_m,high_m,coverage\n" : ",coverage\n";
  const auto height = [](const ProfilePoint& p, double by) {
    return has_height(p) ? fmt::format("{:.6f}", p.height.height_m + by) : std::string();
  };
  for (const ProfilePoint& p : profile.points) {
    text += fmt::format("{:.6f},{:.11f},{:.11f},{}", p.distance_m, p.place.lon, p.place.lat,
                        height(p, 0));
    if (facts.bound_m) text += "," + height(p, -*facts.bound_m) + "," + height(p, *facts.bound_m);
    text += fmt::format(",{}\n", word(p.height.coverage));
  }
  return text;
}

/// length_m, datum, max_error_m.
Ordered facts_json(const Profile& profile, const ProfileFacts& facts) {
  Ordered json = {{"length_m", metres(profile.length_m)}, {"datum", facts.datum}};
  if (facts.bound_m) {
    json["max_error_m"] = *facts.bound_m;
    json["max_error_holds"] = facts.bound_at_posts_only ? "at posts" : "everywhere";
  }
  return json;
}

/// The columns that every format has, by their names.
Ordered columns_json(const Profile& profile, const ProfileFacts& facts) {
  Ordered columns = {{"distance_m", Ordered::array()}, {"height_m", Ordered::array()}};
  if (facts.bound_m) columns["low_m"] = columns["high_m"] = Ordered::array();
  for (const ProfilePoint& p : profile.points) {
    columns["distance_m"].push_back(metres(p.distance_m));
    columns["height_m"].push_back(height_json(p));
    if (!facts.bound_m) continue;
    columns["low_m"].push_back(height_json(p, -*facts.bound_m));
    columns["high_m"].push_back(height_json(p, *facts.bound_m));
  }
  return columns;
}

Ordered line_json(const Profile& profile) {
  std::vector<LinePoint> line;
  line.reserve(profile.points.size());
  for (const ProfilePoint& p : profile.points)
    line.push_back({p.place, has_height(p) ? p.height.height_m : std::nan("")});
  const bool whole = has_all_heights(line);
  Ordered parts = Ordered::array();
  for (const HeightLine& part : line_parts(line)) {
    Ordered positions = Ordered::array();
    for (const LinePoint& p : part) {
      Ordered position = {degrees(p.place.lon), degrees(p.place.lat)};
      if (whole) position.push_back(metres(p.height_m));
      positions.push_back(std::move(position));
    }
    parts.push_back(std::move(positions));
  }
  if (parts.size() == 1) return {{"type", "LineString"}, {"coordinates", std::move(parts[0])}};
  return {{"type", "MultiLineString"}, {"coordinates", std::move(parts)}};
}

Ordered geojson(const Profile& profile, const ProfileFacts& facts) {
  Ordered properties = facts_json(profile, facts);
  properties.update(columns_json(profile, facts));
  return {
      {"type", "Feature"}, {"geometry", line_json(profile)}, {"properties", std::move(properties)}};
}

Ordered plain_json(const Profile& profile, const ProfileFacts& facts) {
  Ordered json = facts_json(profile, facts);
  json["points"] = Ordered::array();
  for (const ProfilePoint& p : profile.points) {
    Ordered point = {{"distance_m", metres(p.distance_m)},
                     {"lon", degrees(p.place.lon)},
                     {"lat", degrees(p.place.lat)},
                     {"height_m", height_json(p)}};
    if (facts.bound_m) {
      point["low_m"] = height_json(p, -*facts.bound_m);
      point["high_m"] = height_json(p, *facts.bound_m);
    }
    point["coverage"] = word(p.height.coverage);
    json["points"].push_back(std::move(point));
  }
  return json;
}

Ordered coverage_json(const Profile& profile, const ProfileFacts& facts) {
  Ordered tuples = Ordered::array();
  for (const ProfilePoint& p : profile.points)
    tuples.push_back({degrees(p.place.lon), degrees(p.place.lat)});
  Ordered json = {{"type", "Coverage"}};
  json["domain"] = {
      {"type", "Domain"},
      {"domainType", "MultiPoint"},
      {"axes",
       {{"composite",
         {{"dataType", "tuple"}, {"coordinates", {"x", "y"}}, {"values", std::move(tuples)}}}}},
      {"referencing",
       Ordered::array({{{"coordinates", {"x", "y"}},
                        {"system",
                         {{"type", "GeographicCRS"},
                          {"id", "http://www.opengis.net/def/crs/OGC/1.3/CRS84"}}}}})}};
  const Ordered columns = columns_json(profile, facts);
  for (const auto& [name, values] : columns.items()) {
    const std::string label = name == "distance_m" ? "Distance along the line"
                              : name == "height_m" ? "Height above " + facts.datum
                              : name == "low_m"    ? "The height is not below"
                                                   : "The height is not above";
    json["parameters"][name] = {{"type", "Parameter"},
                                {"observedProperty", {{"label", {{"en", label}}}}},
                                {"unit", {{"symbol", "m"}}}};
    json["ranges"][name] = {{"type", "NdArray"},
                            {"dataType", "float"},
                            {"axisNames", {"composite"}},
                            {"shape", {profile.points.size()}},
                            {"values", values}};
  }
  return json;
}

}  // namespace

Result<ProfileFormat> profile_format(const std::string& path) {
  const std::string extension = lower_extension(path);
  if (!extension.empty())
    if (const auto format = enum_named<ProfileFormat>(extension.substr(1))) return *format;
  return fail(Errc::invalid_argument, "cannot tell the format of the profile " + path +
                                          ": name it .csv, .geojson, .json or .covjson");
}

std::string profile_text(ProfileFormat format, const Profile& profile, const ProfileFacts& facts) {
  switch (format) {
    case ProfileFormat::csv:
      return csv_text(profile, facts);
    case ProfileFormat::geojson:
      return json::to_text(geojson(profile, facts)) + "\n";
    case ProfileFormat::json:
      return json::to_text(plain_json(profile, facts)) + "\n";
    case ProfileFormat::covjson:
      return json::to_text(coverage_json(profile, facts)) + "\n";
  }
  return {};
}

Ordered profile_summary(const std::string& path, const Profile& profile,
                        const ProfileFacts& facts) {
  const auto without = profile.points.size() - std::ranges::count_if(profile.points, has_height);
  Ordered json = {{"output", path}, {"places", profile.points.size()}, {"without_height", without}};
  json.update(facts_json(profile, facts));
  return json;
}

std::string profile_summary_line(const Ordered& summary) {
  return fmt::format("{}: {} places along {:.3f} km, {} without height\n",
                     summary["output"].get<std::string>(), summary["places"].get<std::size_t>(),
                     summary["length_m"].get<double>() / 1000,
                     summary["without_height"].get<std::size_t>());
}

}  // namespace tind::cli
