#pragma once
// FlightGear's scenery as files, for fgfs on the same machine and for TerraSync from any static
// server: the same bytes as on demand.

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "proto/tile/terrasync.h"
#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/flightgear/bucket_plan.h"
#include "terrain/raster/land_cover.h"

namespace tind::flightgear {

struct SceneryReport {
  std::uint64_t buckets = 0;  // there now
  std::uint64_t kept = 0;     // of these, made before
  std::uint64_t empty = 0;    // without a valid post, so without a file
  std::uint64_t bytes = 0;    // of all files of buckets
  std::uint64_t over_budget = 0;
  std::uint64_t partly_void = 0;           // buckets with ground whose height is not known
  double void_share = 0;                   // of the ground of all
  double worst_error_m = 0, budget_m = 0;  // of any; the strictest asked for
  bool there = false;                      // all of it was, and nothing was done
};

struct SceneryOptions {
  int threads = 0;                   // 0: one per core
  const LandCover* cover = nullptr;  // what make_bucket() takes; null: none
  bool force = false;                // replace what was made of another surface or otherwise
};

/// Writes Terrain/{ten degrees}/{one degree}/{number}.stg and .btg.gz, and a .dirindex in every
/// folder, that of the root last, when all else stays also if the power is cut. Killed and run
/// again, it goes on. Buckets of another surface or of other options that were written here are
/// refused, or with `force` replaced, or removed: files with the name of a bucket of their folder
/// whose .stg is not another's, and indices that name nothing else. What others put there stays,
/// but in the place of what is made. A folder that begins with files of others is refused, and so,
/// with nothing changed, is a link or another thing in the place of a bucket or of a folder on the
/// way to one (invalid_argument). On a stop: Errc::cancelled.
Result<SceneryReport> write_scenery(const BucketPlan&, const std::string& folder,
                                    const SceneryOptions& = {}, const Progress& = {});

/// A file of a bucket and its bytes.
using SceneryFile = std::pair<std::string, std::string>;
/// The .dirindex of a folder of one degree.
std::string folder_index(Folder, std::span<const SceneryFile>);

}  // namespace tind::flightgear
