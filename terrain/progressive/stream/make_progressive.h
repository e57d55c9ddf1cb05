#pragma once
// From a DEM to a progressive mesh, by any method that collapses edges.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/progressive/stream/progressive_mesh.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/options.h"

namespace tind {

/// The methods that collapse: edge-cost, qem, memoryless, attribute-qem,
/// triangle-collapse, bounded.
bool makes_progressive(const MethodOptions&);

/// The fine end is what `method` makes at its own `stop` (nothing set: the full grid), the coarse
/// end has `base_triangles` triangles (one more as parity asks; more where nothing can collapse any
/// further). All positions, in every state, lie on `lattice`, and every bound on the error is of
/// the mesh with these positions.
///
/// GUARANTEES: every prefix is a valid mesh that covers what the full mesh covers, with nothing
/// flipped; borders stay on the rectangle's sides, borders of voids stay as they are; error_m as
/// progressive_mesh.h says. A max error at the fine end is kept by all methods to the lattice's
/// half step of height; fine_error_m is the exact figure.
/// COST: the method's own time, plus about one scan of each new star.
Result<ProgressiveMesh> make_progressive(const Terrain& dem, const SimplifyOptions& method,
                                         std::size_t base_triangles, const Progress& progress,
                                         const Lattice& lattice = {});

/// Every error of a mesh of posts that lie up to `rounding_m` beside the source's heights
/// (raster/height_rounding.h), as it is over these.
void widen(ProgressiveMesh&, double rounding_m);

}  // namespace tind
