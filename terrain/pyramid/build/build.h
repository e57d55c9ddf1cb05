#pragma once
// The batch: every tile of a plan into a directory.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/store/open/open_store.h"
#include "terrain/surface/surface.h"

namespace tind {

struct BuildOptions {
  TileSetOptions tiles;
  std::string output;  // directory, made if need be
  int threads = 0;     // 0: one per core
  bool gzip = false;   // store tiles compressed (the server then has to say so)
  bool force = false;  // replace tiles that tind build made of another source or otherwise
  int batch = 1024;    // tiles, at most, until those written are made durable and count
  /// How `output` becomes the store that is written.
  std::function<Result<std::unique_ptr<LockedStore>>(const std::string& output)> lock = lock_store;
};

/// As `gzip` stores tiles.
std::vector<std::uint8_t> gzipped(const std::vector<std::uint8_t>& bytes);

struct LevelReport {
  int level = 0;
  std::uint64_t tiles = 0, bytes = 0;
  double budget_m = 0, worst_error_m = 0;
  double worst_edge_error_m = 0;  // skirts this deep and those of the level above hide every gap
};

/// What a build found in a directory of tiles that can become its own: of other heights, of other
/// files or of other layers.
struct UpdateReport {
  bool updated = false;                  // false: there were none, or they are as they should be
  std::vector<std::string> new_layers;   // names of those that are new, or on another grid
  std::vector<std::string> bent_layers;  // of those that blend otherwise
  std::size_t gone_layers = 0;
  std::string everything;        // why all tiles are made again, if they are
  std::uint64_t gone_tiles = 0;  // there is nothing any more where they were
  // Of the layers that are in both, block_posts x block_posts posts each.
  std::uint64_t blocks = 0, changed_blocks = 0;
  int block_posts = 0;
  std::uint64_t dirty_tiles = 0;  // depend on what changed, and are made again
  int levels_of_other_steps = 0;  // the range of heights changed: whole levels are made again
};

/// What build_tiles() would find in o.output, with nothing made or changed. Reads every post. Fails
/// as that does, with invalid_argument where it would refuse what is there.
Result<UpdateReport> foresee_update(const Surface&, const BuildOptions&, const Progress& = {});

struct BuildReport {
  std::uint64_t tiles = 0, built = 0, reused = 0, bytes = 0;
  // Of an earlier run: torn, changed, missing, or not yet made durable. They were made again.
  std::uint64_t unsound = 0;
  std::uint64_t over_budget = 0;   // tiles that say a larger error than their level's budget
  std::string worst_over_budget;   // z/x/y of the one most times over its budget
  double worst_over_budget_m = 0;  // what it says
  double worst_budget_m = 0;       // in place of this
  std::uint64_t by_bounded = 0;    // of `built`: instead of the method, over the budget with it
  // Of `built`: without the dataset's lines, which left them far over their budget. z/x/y of some.
  std::uint64_t without_lines = 0;
  std::vector<std::string> some_without_lines;
  std::uint64_t not_one_sided = 0;  // tiles that --side asked for and could not be: they say "both"
  std::vector<LevelReport> levels;
  UpdateReport update;
  int indexed_level = -1;  // up to this one tiles rest on the residual index; -1: none
  std::uint64_t index_bytes = 0;
  bool index_made = false;  // by this run
  int threads = 1;
};

/// Makes what is missing: a tile that the directory's ledger names, and whose size and hash are as
/// it says, is kept, so a build that was killed, or lost its power, goes on where it was. The
/// directory remembers the source's heights and the options. Where heights changed, the tiles that
/// depend on them are made again and no others, and take the old ones' places when all are ready;
/// other grids and options are refused unless `force`. What tind build did not make is never
/// touched: where it is in the way, or another build runs in the directory (Errc::busy), nothing is
/// done. layer.json comes last, and only when all tiles are there. On a stop: Errc::cancelled,
/// nothing torn, run again to go on.
Result<BuildReport> build_tiles(const Surface&, const BuildOptions&, const Progress& = {});

}  // namespace tind
