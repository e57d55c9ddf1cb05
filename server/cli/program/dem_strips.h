#pragma once
// A DEM that is larger than memory, from north to south.

#include <functional>
#include <span>

#include "terrain/base/result.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"
#include "terrain/simplify/clustering/clustering.h"

namespace tind::cli {

/// Larger sources than this are not held in memory by what can do without.
inline constexpr std::int64_t kStreamPosts = std::int64_t(1) << 25;

/// All columns of [row, row + rows). Valid while the source is.
ReadStrip strips_of(const DemSource&);

/// Up to 8 x 8 blocks of 256 x 256 posts, spread evenly: what can be said of a large DEM soon.
Result<void> for_sample_blocks(const DemSource&, const std::function<void(const HeightGrid&)>&);

/// Row by row, read in strips; going back to row 0 is allowed.
ReadRow rows_of(const DemSource&);

}  // namespace tind::cli
