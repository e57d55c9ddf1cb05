#pragma once
// A DEM that is larger than memory, from north to south.

#include <span>

#include "terrain/mesh/vertical_error.h"
#include "terrain/raster/dem_source.h"
#include "terrain/simplify/clustering.h"

namespace tind::cli {

/// Larger sources than this are not held in memory by what can do without.
inline constexpr std::int64_t kStreamPosts = std::int64_t(1) << 25;

/// All columns of [row, row + rows). Valid while the source is.
ReadStrip strips_of(const DemSource&);

/// Row by row, read in strips; going back to row 0 is allowed.
ReadRow rows_of(const DemSource&);

}  // namespace tind::cli
