#pragma once
// A DEM in memory: heights on a grid, and how far apart its posts lie on the ground.

#include <utility>

#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"

namespace tind {

struct Terrain {
  HeightGrid grid;
  double spacing_x_m = 1, spacing_y_m = 1;  // ground distance of neighbours in a row, a column
};

/// Any part of a DEM with the spacing of the whole.
inline Terrain terrain_of(HeightGrid grid, const DemInfo& info) {
  return {std::move(grid), info.spacing_x_m, info.spacing_y_m};
}

}  // namespace tind
