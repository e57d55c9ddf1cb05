#pragma once
// Posts that are no raster's, as a DEM: whoever computes heights on a grid (of a mesh, say) gets
// from here what rasters have, a reference system, a datum and a way to another one.

#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"

namespace tind {

struct HeldPosts {
  std::string name;      // of what they were taken from: in messages and as the only file
  std::string kind;      // of that, as DemInfo::driver has it
  HeightGrid heights;    // metres
  Affine post_to_crs;    // not singular
  std::string crs = {};  // what that says x and y are in, "EPSG:2056" or WKT; empty: nothing
  VerticalDatum datum = VerticalDatum::unknown;  // what it says heights are above
};

/// Of the options those count that say where posts are and what heights are above: crs, from_datum,
/// to_datum, accuracy, environment. Fails (bad_data) for a CRS that nobody knows or that names a
/// file, or heights beyond 16384 m, and as DemSource::open does where heights cannot be brought to
/// a datum.
Result<std::shared_ptr<const DemSource>> dem_of(HeldPosts, const DemOptions& = {});

}  // namespace tind
