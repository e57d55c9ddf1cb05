#pragma once
// `bounded` with an order: from all posts on, always the collapse whose exact error over the posts
// is least, at the height that makes it least (floating heights, as `bounded` has them).
//
// `bounded` itself reaches one error, sweeping up every collapse that stays within the band, and
// moves vertices afterwards: nothing that could be played backwards. Here the largest error over
// all posts, which it promises, is the cost itself.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/simplify.h"

namespace tind {

/// As simplify() with options.recorder set.
/// COST: every candidate's star is scanned: about ten times qem.
Result<Simplified> record_bounded_collapses(const Terrain& dem, const RunOptions&, const Progress&);

}  // namespace tind
