#pragma once
// From shards to the tile set: the levels above them are made, and all is joined.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/shards/make_shard.h"
#include "terrain/store/tile_store.h"

namespace tind {

struct MergeOptions {
  ShardOptions shards;  // where they are, and how the top is made
  std::string output;   // X.pmtiles, X.mbtiles or a directory
  bool force = false;   // as CopyOptions
};

struct MergeReport {
  std::uint64_t tiles = 0, kept = 0, bytes = 0;  // as of a copy
  std::uint64_t top_made = 0;
};

/// The shards of a plan as one store. REQUIRES: all are there (judge_shard). The plan must
/// outlive it.
Result<std::unique_ptr<TileStore>> merged_store(const ShardPlan&, const std::string& folder);

/// Is the tile set of this plan there, as merge_shards() leaves it? By its record and its
/// layer.json, which come last, and the number of tiles; no tile is read (verify_store() reads
/// all). Fails where that cannot be read (io, busy).
Result<bool> is_merged(const ShardPlan&, const std::string& output);

/// Every pack is hashed first: busy where shards are missing, bad_data where one is not as its
/// record says; both name them, and nothing is made. The result is what tind build makes of the
/// same source, byte for byte. `open`: called where the top is still to be made. Killed, run again,
/// it goes on.
Result<MergeReport> merge_shards(const ShardPlan&, const std::function<Result<Surface>()>& open,
                                 const MergeOptions&, const Progress& = {});

}  // namespace tind
