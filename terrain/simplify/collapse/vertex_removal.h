#pragma once
// `vertex-removal`: removes vertices one by one and triangulates each hole again.
//
// The method of [Schroeder92]. [Kim] uses it as a baseline, with three criteria for which vertex
// goes first:
//   plane      the vertex nearest to the average plane of its ring (on the border: to the line
//              through its border neighbours), in metres
//   degree     the vertex with the fewest edges
//   k-degree   the same; ties go to the vertex whose `k` lowest neighbours have the fewest edges
// All vertices of the result are posts of the source.
//
// The hole is filled with the ears of a Delaunay triangulation of the ring ([Devillers99]: the ear
// of least power first). A border vertex may be removed only where the border runs straight on, so
// the outline never changes; corners stay. The order is smallest first, to within one bucket
// (BucketQueue), in rounds: the ring of a removed vertex waits for the next round, so that equal
// vertices thin out evenly.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

/// Reads `criterion`, `k` (1..16) and `stop` of the options. A removal that would move the surface
/// past `max_error_m` at any post is refused, and the vertex is tried again once its ring changes.
/// Fails (invalid_argument) on an unknown criterion or a k out of range.
Result<Simplified> simplify_vertex_removal(const Terrain& dem, const SimplifyOptions&,
                                           const Progress&);

}  // namespace tind
