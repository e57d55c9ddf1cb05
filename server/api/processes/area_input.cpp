#include "server/api/processes/area_input.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "server/api/crs_name.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;

void read_crs(const Json* json, const std::string& name, std::string& crs, Problems& problems) {
  if (!json) return;
  const auto named = json->is_string() ? crs_named(json->get<std::string>()) : std::nullopt;
  if (named)
    crs = *named;
  else
    problems.add(name, "must be CRS84 or " + std::string(kCrsForm));
}

std::string bounds_of(const std::array<double, 4>& box) {
  std::string text;
  for (const double v : box) text += (text.empty() ? "" : ",") + Ordered(v).dump();
  return text;
}

std::optional<std::array<double, 4>> box_of(const Json& json) {
  if (!json.is_array() || json.size() != 4) return {};
  std::array<double, 4> box{};
  for (std::size_t i = 0; i < 4; ++i) {
    if (!json[i].is_number() || !std::isfinite(json[i].get<double>())) return {};
    box[i] = json[i];
  }
  return box;
}

/// The positions of coordinates nested as deep as geometries have them.
struct Positions {
  std::size_t count = 0;
  bool bad = false;
  const double farthest_x, farthest_y;

  std::array<double, 4> box{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

  void take(const Json& coordinates, int depth) {
    if (!coordinates.is_array() || depth > 4 || count > kMostPositions) {
      bad = true;
      return;
    }
    if (coordinates.size() >= 2 && coordinates[0].is_number() && coordinates[1].is_number()) {
      const double x = coordinates[0], y = coordinates[1];
      bad = bad || !(std::abs(x) <= farthest_x && std::abs(y) <= farthest_y);
      box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x), std::max(box[3], y)};
      ++count;
      return;
    }
    for (const Json& part : coordinates) take(part, depth + 1);
  }
};

/// Of a CRS by its name: degrees, or a projection's metres or feet.
Positions positions_in(const std::string& crs) {
  const bool degrees = crs == "CRS84";
  return {.farthest_x = degrees ? 540. : 1e10, .farthest_y = degrees ? 90. : 1e10};
}

/// A polygon's rectangle, a little wider: posts on its rim then have neighbours on both sides.
std::string bounds_around(std::array<double, 4> box, bool degrees) {
  constexpr double kWider = 1e-3;
  const double dx = kWider * (box[2] - box[0]), dy = kWider * (box[3] - box[1]);
  if (!degrees || box[2] - box[0] < 350) box[0] -= dx, box[2] += dx;
  box[1] -= dy, box[3] += dy;
  if (degrees) box[1] = std::max(box[1], -90.), box[3] = std::min(box[3], 90.);
  return bounds_of(box);
}

/// A geometry, or that of a Feature; null: neither.
const Json* geometry_of(const Json& json) {
  if (!json.is_object()) return nullptr;
  const auto type = json.find("type");
  if (type == json.end() || !type->is_string()) return nullptr;
  if (*type != "Feature") return json.contains("coordinates") ? &json : nullptr;
  const auto geometry = json.find("geometry");
  return geometry != json.end() && geometry->is_object() && geometry->contains("coordinates")
             ? &*geometry
             : nullptr;
}

/// Of one geometry, or of a collection of Features.
std::vector<const Json*> geometries_of(const Json& json) {
  std::vector<const Json*> all;
  const auto features = json.is_object() ? json.find("features") : json.end();
  if (json.is_object() && features != json.end() && features->is_array()) {
    for (const Json& feature : *features) all.push_back(geometry_of(feature));
    if (!all.empty()) return all;
  }
  all.push_back(geometry_of(json));
  return all;
}

bool is_one_of(const Json& geometry, std::initializer_list<const char*> types) {
  const auto type = geometry.find("type");
  return type != geometry.end() && type->is_string() &&
         std::ranges::any_of(types, [&](const char* t) { return *type == t; });
}

/// Of a Feature's properties those that are one value.
Ordered plain_properties(const Json& feature) {
  Ordered plain = Ordered::object();
  const auto all = feature.find("properties");
  if (all == feature.end() || !all->is_object()) return plain;
  for (const auto& [name, value] : all->items())
    if (value.is_primitive()) plain[name] = value;
  return plain;
}

/// Beside geometries_of(): the properties of each.
std::vector<Ordered> properties_of(const Json& json, std::size_t count) {
  const auto features = json.find("features");
  if (features == json.end() || !features->is_array() || features->size() != count)
    return std::vector<Ordered>(count, plain_properties(json));
  std::vector<Ordered> all;
  for (const Json& feature : *features) all.push_back(plain_properties(feature));
  return all;
}

/// A table of them has a column for each name.
bool are_few(const std::vector<Ordered>& properties) {
  std::set<std::string> names;
  for (const Ordered& one : properties)
    for (const auto& [name, value] : one.items())
      if (names.insert(name).second && names.size() > kMostNames) return false;
  return true;
}

/// The geometries in the CRS, as a file, each with what `properties` has for it: nothing else of
/// what was sent goes into one.
std::string file_of(const std::vector<const Json*>& geometries,
                    const std::vector<Ordered>& properties, const std::string& crs) {
  Ordered features = Ordered::array();
  for (std::size_t i = 0; i < geometries.size(); ++i) {
    const Json& g = *geometries[i];
    features.push_back({{"type", "Feature"},
                        {"properties", properties[i]},
                        {"geometry", {{"type", g["type"]}, {"coordinates", g["coordinates"]}}}});
  }
  Ordered json = {{"type", "FeatureCollection"}};
  if (crs != "CRS84")
    json["crs"] = {{"type", "name"},
                   {"properties", {{"name", "urn:ogc:def:crs:EPSG::" + crs.substr(5)}}}};
  json["features"] = std::move(features);
  return json.dump();
}

/// Empty, and a problem, where it is not what `types` says. `named`: properties are wanted, too.
std::string read_shapes(const Json& json, const std::string& name,
                        std::initializer_list<const char*> types, const std::string& what,
                        const std::string& crs, Problems& problems, Positions& positions,
                        bool named = false) {
  const auto geometries = geometries_of(json);
  for (const Json* g : geometries) {
    if (!g || !is_one_of(*g, types)) {
      problems.add(name, "must be GeoJSON: " + what + ", or Features of such");
      return {};
    }
    positions.take((*g)["coordinates"], 0);
  }
  const auto properties = named ? properties_of(json, geometries.size())
                                : std::vector<Ordered>(geometries.size(), Ordered::object());
  if (positions.count > kMostPositions)
    problems.add(name, "must have at most " + std::to_string(kMostPositions) + " positions");
  else if (positions.bad || positions.count == 0)
    problems.add(name, "has coordinates that are no positions of " + crs);
  else if (!are_few(properties))
    problems.add(name, "must have at most " + std::to_string(kMostNames) +
                           " names of properties in all Features");
  else
    return file_of(geometries, properties, crs);
  return {};
}

}  // namespace

AreaInput read_area(Members& inputs, Problems& problems) {
  AreaInput area;
  const Json* const bbox = inputs.member("bbox");
  const Json* const polygon = inputs.member("polygon");
  read_crs(inputs.member("crs"), "crs", area.crs, problems);
  if (bbox && polygon) {
    problems.add("polygon", "and bbox name two areas: leave one out");
    return area;
  }
  if (bbox) {
    const Json* box = bbox;
    if (bbox->is_object()) {
      Members members(*bbox, "bbox", problems);
      box = members.member("bbox", Members::Need::must);
      read_crs(members.member("crs"), "bbox.crs", area.crs, problems);
      members.nothing_else();
    }
    const auto four = box ? box_of(*box) : std::nullopt;
    const bool in_order =
        four && (*four)[1] < (*four)[3] && (area.crs == "CRS84" || (*four)[0] < (*four)[2]);
    if (four && !in_order)
      problems.add("bbox", "must have the smaller x and y first, [west, south, east, north]");
    else if (four)
      area.bounds = bounds_of(*four);
    else if (box)
      problems.add("bbox", "must be [west, south, east, north], four numbers");
  }
  if (polygon) {
    Positions positions = positions_in(area.crs);
    area.polygon = read_shapes(*polygon, "polygon", {"Polygon", "MultiPolygon"},
                               "a Polygon or MultiPolygon", area.crs, problems, positions);
    const auto& box = positions.box;
    if (!area.polygon.empty() && !(box[0] < box[2] && box[1] < box[3]))
      problems.add("polygon", "has no area");
    else if (!area.polygon.empty())
      area.bounds = bounds_around(box, area.crs == "CRS84");
  }
  return area;
}

std::string read_places_crs(Members& inputs, Problems& problems) {
  std::string crs = "CRS84";
  read_crs(inputs.member("crs"), "crs", crs, problems);
  return crs;
}

std::string read_geojson(const char* name, Members& inputs, Problems& problems,
                         const std::string& crs) {
  const Json* const json = inputs.member(name);
  if (!json) return {};
  Positions positions = positions_in(crs);
  const bool lines = std::string_view(name) == "breaklines";
  return lines ? read_shapes(*json, name,
                             {"LineString", "MultiLineString", "Polygon", "MultiPolygon"},
                             "lines or polygons", crs, problems, positions)
               : read_shapes(*json, name, {"Polygon", "MultiPolygon"}, "polygons", crs, problems,
                             positions, std::string_view(name) == "polygons");
}

void describe_area(Ordered& inputs) {
  inputs["bbox"] = {
      {"title", "Area, as a rectangle"},
      {"description",
       "[west, south, east, north], in crs; of CRS84 west may be greater than east, across the "
       "antimeridian. The mesh has the posts of the smallest rectangle of the DEM's own grid "
       "around it."},
      {"minOccurs", 0},
      {"schema",
       {{"oneOf",
         {{{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 4}, {"maxItems", 4}},
          {{"type", "object"},
           {"required", {"bbox"}},
           {"properties",
            {{"bbox",
              {{"type", "array"},
               {"items", {{"type", "number"}}},
               {"minItems", 4},
               {"maxItems", 4}}},
             {"crs", {{"type", "string"}}}}}}}}}}};
  inputs["polygon"] = {{"title", "Area, as a polygon"},
                       {"description",
                        "A Polygon or MultiPolygon of GeoJSON, or a Feature of one, in crs. Its "
                        "rim becomes edges of the mesh."},
                       {"minOccurs", 0},
                       {"schema", {{"type", "object"}}}};
  inputs["crs"] = {{"title", "CRS of bbox, polygon and lines"},
                   {"description", "CRS84 (longitude, latitude) or EPSG:CODE; x before y"},
                   {"minOccurs", 0},
                   {"schema", {{"type", "string"}, {"default", "CRS84"}}}};
}

}  // namespace tind::api
