#pragma once
// Makes one shard: its tiles as a PMTiles archive, then the record that commits it.

#include <cstddef>
#include <cstdint>
#include <stop_token>
#include <string>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/shards/shard_files.h"
#include "terrain/pyramid/shards/shard_plan.h"
#include "terrain/surface/surface.h"

namespace tind {

struct ShardOptions {
  std::string folder;            // has, or gets, the folder `shards`
  int threads = 0;               // 0: one per core
  std::stop_token abandon = {};  // stops tiles, too, that are being made
  double heartbeat_s = 5;
};

struct ShardReport {
  std::uint64_t tiles = 0, made = 0, kept = 0, bytes = 0;  // bytes: of the pack
  bool there = false;                                      // it was there, whole: nothing was done
  std::string sha256;
};

/// May run twice, anywhere, at once, and be killed at any moment: the pack has the same bytes, and
/// counts once its record is there. One that is there, and is not as its record says, is made
/// again. What a run leaves that was stopped or killed, the next one goes on with, tile by tile.
/// Errc::cancelled when the progress says stop: tiles that are being made are finished, and what is
/// made is kept. Fails (invalid_argument) where the surface is not what was planned. Any other
/// error is left in the folder, too, for shard_status().
Result<ShardReport> make_shard(const Surface&, const ShardPlan&, std::size_t shard,
                               const ShardOptions&, const Progress& = {});

}  // namespace tind
