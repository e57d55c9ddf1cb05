#pragma once
// The water of a tile as the `watermask` extension of quantized-mesh has it.

#include <cstdint>
#include <memory>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"
#include "terrain/shapes/area_set.h"

namespace tind {

/// Where water is: polygons, or a raster whose valid posts that are not 0 are water, or both.
struct WaterSource {
  AreaSet areas;
  std::vector<std::shared_ptr<const DemSource>> rasters;
  bool empty() const { return areas.empty() && rasters.empty(); }
};

/// One byte where all of the rectangle is water (255) or none (0); else 256 x 256 bytes, row 0 in
/// the north, each row from west to east: which share of the cell is water, of 255. So the coast is
/// as smooth as clients, which filter linearly, can draw it. Of polygons it is exact from west to
/// east and taken at 8 parallels a cell; of rasters at 4 x 4 places a cell, of their nearest posts.
/// A function of the rectangle and the water alone. Fails where a raster cannot be read.
Result<std::vector<std::uint8_t>> water_mask(const WaterSource&, const GeoRect&);

}  // namespace tind
