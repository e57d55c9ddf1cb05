#pragma once
// `bounded` with an order: from all posts on, bound after bound (record_by_bounds). Within a bound,
// always the collapse that adds least to the sum of the squared errors of the posts, its vertex
// where a Gauss-Newton step puts it; and only one that leaves no post beyond the bound.
//
// `bounded` itself reaches one error, sweeping up every collapse that stays within the band, and
// moves vertices afterwards: nothing that could be played backwards. At one bound it needs about a
// fifth fewer triangles than the state of the progressive mesh that is within it.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/simplify.h"

namespace tind {

/// As simplify() with options.recorder set.
/// COST: every candidate's star is scanned, about twenty times qem.
Result<Simplified> record_bounded_collapses(const Terrain& dem, const RunOptions&, const Progress&);

}  // namespace tind
