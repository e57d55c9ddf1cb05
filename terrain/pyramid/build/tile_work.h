#pragma once
// What a build tells the store that it writes: how its tiles are made, and which of those that are
// there it has to make again.

#include "terrain/geo/tile_order.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/store/tile_writer.h"
#include "terrain/surface/surface.h"
#include "terrain/surface/surface_blocks.h"

namespace tind {

/// All that is given must outlive the work. `update` is filled in when the store asks for changes.
TileWork tile_work(const Surface&, const TilePlan&, const TileOrder&, const SurfaceBlocks&,
                   const BuildOptions&, UpdateReport& update);

}  // namespace tind
