#pragma once
// `greedy`: greedy insertion into a Delaunay triangulation [Garland95]: from two triangles on, the
// worst sample becomes a vertex, until none is worse than asked or the count is reached. Vertices
// are posts. What GIS tools use, and the baseline for `bounded`.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/height_grid.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

/// O(n log n) expected. GUARANTEES with --max-error M: every valid post within M of the mesh, to
/// the rounding of doubles (1e-12 of the relief).
Result<Simplified> simplify_greedy(const HeightGrid&, double spacing_x_m, double spacing_y_m,
                                   const SimplifyOptions&, const Progress&);

}  // namespace tind
