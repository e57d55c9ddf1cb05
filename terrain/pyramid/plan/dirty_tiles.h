#pragma once
// Which tiles an update has to make again.

#include <vector>

#include "terrain/geo/tile_order.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/surface/surface.h"
#include "terrain/surface/surface_blocks.h"

namespace tind {

/// One flag for each of `ids`: does the tile depend on a block that changed? A tile depends on the
/// posts of its rectangle and a few around (neighbours share lines; normals reach farther), and,
/// where there are voids among them or the source ends, on all that could fill those. An ancestor
/// depends on what its descendants do. What a layer
/// bends lies farther away, too. `before` and `after` are of the same layers.
std::vector<std::uint8_t> dirty_tiles(const Surface&, const TilePlan&, const TileOrder& ids,
                                      const SurfaceBlocks& before, const SurfaceBlocks& after);

}  // namespace tind
