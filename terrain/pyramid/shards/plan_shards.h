#pragma once
// Makes the plan of a surface, and finds a surface and a plan to be of each other.

#include <cstddef>
#include <cstdint>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/pyramid/shards/shard_plan.h"
#include "terrain/surface/surface.h"

namespace tind {

/// How many shards there are to be: so many, or as many as give none many more tiles than that.
struct ShardWish {
  std::uint64_t shards = 0, tiles_per_shard = 0;  // one of both
};

/// Reads every post once. The level of the subtrees is the first with eight of them a shard, else
/// the deepest, and none whose tiles rest on the residual index; runs are cut where the cost is
/// about even, which is told from how many posts are void. Fails (invalid_argument) where so many
/// shards cannot be, and where all tiles rest on the index.
Result<ShardPlan> plan_shards(const Surface&, const BuildOptions&, const ShardWish&, PlannedSource,
                              const Progress& = {});

/// The plan of the pyramid that a plan of shards speaks of, without its index. Reads no post. Fails
/// (invalid_argument) where the surface's grid, its lines or its water are others than those
/// planned.
Result<TilePlan> planned_tiles(const Surface&, const ShardPlan&);

/// Which records of the residual index a shard makes: of each tile that holds subtrees, the shard
/// with the first of them; all others are dealt out in turn. Of the top none: it makes what nobody
/// has made.
std::vector<TileId> residual_tiles(const Surface&, const TilePlan&, const ShardTiles&,
                                   std::size_t shard);

/// Are the posts that a shard's tiles and `more` depend on as they were planned? Of the
/// top: all posts. Reads them once. invalid_argument, naming the first place where they are not.
Result<void> check_planned_posts(const Surface&, const TilePlan&, const ShardPlan&,
                                 const ShardTiles&, std::size_t shard, int threads,
                                 const Progress& = {}, const std::vector<TileId>& more = {});

}  // namespace tind
