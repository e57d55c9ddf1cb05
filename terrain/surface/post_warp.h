#pragma once
// Computes where posts lie on the globe, fast, for whole windows of posts of any projected source.

#include <cstdint>
#include <vector>

#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// The extent of a tile's integer grid (coordinates.h, "tile").
inline constexpr double kTileExtent = 32767;

/// Geographic positions of the posts (col + i * step, row + j * step), i < cols, j < rows, in row
/// order. Exact for plain lon/lat sources. Else PROJ is asked at every 16th post of a fixed lattice
/// of the source and cubic interpolation does the rest; where that is not within 1e-6 m (posts more
/// than some 100 m apart, a pole), PROJ is asked for every post. A pure function of the post,
/// whatever the window.
std::vector<Geographic> post_positions(const DemSource&, std::int64_t col, std::int64_t row,
                                       int cols, int rows, int step = 1);

}  // namespace tind
