#pragma once
// The one look at every post that the residual index is made of.

#include <stop_token>

#include "terrain/base/result.h"
#include "terrain/pyramid/residual/residual_record.h"
#include "terrain/surface/surface.h"

namespace tind {

/// The record of one tile, straight from its posts: heights of nodes are H of the surface with its
/// voids filled, rounded to `step_m`; residuals are maxima over the posts of each closed cell, for
/// cells of up to 32 x 32 of the tile's own, and bounds by way of those for larger ones. Reads the
/// posts once, an eighth of the tile by an eighth at a time. Of layers posts count where their
/// layer decides, at the heights that H has there, and samples at rims as those of a tile of this
/// level do (rim_samples.h): coarser tiles have no others. Pure. Thread-safe.
Result<ResidualRecord> scan_residuals(const Surface&, TileId, double step_m, std::stop_token = {});

}  // namespace tind
