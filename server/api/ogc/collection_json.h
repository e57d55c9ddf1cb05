#pragma once
// A dataset as a collection: where it is, what it has, which questions it answers.

#include "proto/coverage_json.h"
#include "server/api/ogc/document.h"
#include "server/services/datasets/catalog.h"

namespace tind::api::ogc {

/// What there is to know at each place.
proto::CoverageParameter height_parameter(const std::string& datum);

/// {id, title, description, extent, crs, parameter_names, data_queries, links, ...} as Common,
/// Part 2, and EDR have it. `whole`: also the grid, as GDAL's driver OGCAPI reads it from a draft
/// of Coverages. Asks PROJ for the code of the DEM's system, milliseconds: on a worker. Errc::io
/// where its database cannot be read.
Result<Ordered> collection_json(const Asked&, const services::ServedDataset&, bool whole);

/// The longitudes of a bbox: west is greater than east across the antimeridian.
std::array<double, 4> bbox_of(const GeoRect& box);

/// Words of `f` for answers to EDR queries.
inline constexpr const char* kCoverageJson = "CoverageJSON";
inline constexpr const char* kGeoJson = "GeoJSON";

}  // namespace tind::api::ogc
