#pragma once
// The answer to an EDR query, as CoverageJSON or GeoJSON.

#include <optional>
#include <string>
#include <vector>

#include "server/api/elevation/heights.h"
#include "server/api/ogc/edr_places.h"

namespace tind::api::ogc {

struct EdrHeights {
  std::string datum;
  std::vector<double> values;         // of each place; NaN where there is none
  std::optional<double> max_error_m;  // of meshes, the largest of those asked
  /// No value is farther from the DEM's height at its place, also between posts; nothing where that
  /// is not known of each.
  std::optional<double> off_m;
};

/// CoverageJSON: a Grid of an area or a cube, a Point, else a MultiPoint, in the query's system.
std::string coverage_json_of(const EdrQuery&, const AskedCrs&, const EdrPlaces&, const EdrHeights&);

/// GeoJSON, in longitudes and latitudes whatever the query's system: of a trajectory a LineString
/// each with its heights as third numbers, else a Point each with the property `height`. Places
/// without a height are null there, and have no third number; those outside an area are left out.
std::string geojson_of(const EdrQuery&, const EdrPlaces&, const EdrHeights&);

}  // namespace tind::api::ogc
