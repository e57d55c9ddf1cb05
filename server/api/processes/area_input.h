#pragma once
// The inputs by which a client says where: bbox or polygon, and what their numbers are in.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "server/api/members.h"

namespace tind::api {

/// In each input.
inline constexpr std::size_t kMostPositions = 100'000;
/// Of the properties of all Features together.
inline constexpr std::size_t kMostNames = 100;

struct AreaInput {
  std::string bounds;         // as --bounds takes them; empty: everywhere
  std::string crs = "CRS84";  // as --bounds-crs takes it
  std::string polygon;        // GeoJSON, with its CRS; empty: none
};

/// bbox: [west, south, east, north], or {"bbox": [...], "crs": "..."}; polygon: a Polygon or
/// MultiPolygon of GeoJSON, or a Feature of one; crs of both: "EPSG:2056", "CRS84", or a URI of
/// OGC's for either. At most one of the two.
AreaInput read_area(Members&, Problems&);

/// crs alone, for inputs that are places: CRS84 without.
std::string read_places_crs(Members&, Problems&);

/// Lines of GeoJSON under the name of an input, as the file of a vector option; empty: none.
std::string read_geojson(const char* name, Members&, Problems&, const std::string& crs);

/// How the inputs of read_area() are described.
void describe_area(nlohmann::ordered_json& inputs);

}  // namespace tind::api
