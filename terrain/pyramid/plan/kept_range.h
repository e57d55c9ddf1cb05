#pragma once
// The range of heights of a surface of layers, kept beside its residual index: so that a daemon
// that starts again reads no post. (Of one DEM the index itself knows it. Of layers it knows the
// posts that decide, and a plan goes by all.)

#include <string>

#include "terrain/base/result.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/surface/surface.h"

namespace tind {

struct KeptRange {
  HeightRange range;
  std::string content;  // 32 digits that stand for all heights (SurfaceBlocks::digest)
};

/// `outline`: a plan of the same levels, for which the range is known, too. Fails with not_found;
/// with bad_data for a file that is damaged, or of another surface or other levels.
Result<KeptRange> read_kept_range(const std::string& path, const Surface&, const TilePlan& outline);
Result<void> keep_range(const std::string& path, const Surface&, const TilePlan& outline,
                        const KeptRange&);

}  // namespace tind
