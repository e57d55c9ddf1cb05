#pragma once
// `greedy`: greedy insertion into a Delaunay triangulation [Garland95]: from two triangles on, the
// worst sample becomes a vertex, until none is worse than asked or the count is reached. Vertices
// are posts. What GIS tools use, and the baseline for `bounded`.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

/// O(n log n) expected. GUARANTEES with --max-error M: every valid post within M of the mesh, to
/// the rounding of doubles (1e-12 of the relief).
Result<Simplified> simplify_greedy(const Terrain& dem, const SimplifyOptions&, const Progress&);

}  // namespace tind
