#pragma once
// What a build will make, before it is made: some tiles of each level are made and the rest
// is extrapolated.

#include <memory>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/surface/surface.h"

namespace tind {

struct LevelEstimate {
  int level = 0;
  std::uint64_t tiles = 0;    // exact
  std::uint64_t sampled = 0;  // of them made, to see
  double bytes = 0;           // as stored
  double bytes_error = 0;     // standard error of `bytes`
  double seconds = 0;         // of one thread's time
};

struct BuildEstimate {
  std::vector<LevelEstimate> levels;
  std::uint64_t tiles = 0, sampled = 0;
  double bytes = 0, bytes_error = 0;
  double reading_seconds = 0;  // the pass over all posts that every build begins with
  double seconds = 0;          // of the whole build with so many threads
  int threads = 1;

  /// Of one thread, for all tiles.
  double thread_seconds() const {
    double sum = 0;
    for (const LevelEstimate& l : levels) sum += l.seconds;
    return sum;
  }
};

/// Levels of up to 16 tiles are made whole; of others 16 and the square root of their number, one
/// out of each of as many runs of rows, chosen by the tile's address alone: the same call samples
/// the same tiles. Nothing is written. Times depend on the machine and what else it does.
Result<BuildEstimate> estimate_build(const Surface&, const BuildOptions&, const Progress& = {});

}  // namespace tind
