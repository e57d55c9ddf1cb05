#pragma once
// Simplifies terrain that is a TIN already, as simplify.h does a DEM: the vertices are its posts.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/options.h"

namespace tind {

/// Terrain as a TIN in any planar frame: what as_terrain made (mesh/terrain_tin.h), and what a unit
/// of its coordinates is in metres.
struct TerrainTin {
  Tin tin;
  double x_unit_m = 1, y_unit_m = 1, z_unit_m = 1;
};

/// Every method of the table that can hold a border (MethodInfo::tiles), so not `cluster`, whose
/// cells are those of a grid. Those that collapse start from the TIN's own triangles; `greedy` and
/// `bounded` from its outline, and insert its vertices.
///
/// StopAt::max_error_m is over every vertex of the TIN, and `ratio` of its triangles. GUARANTEES:
/// every triangle counter-clockwise with positive area; the border stays where it is to the bit as
/// seen from above, and vertices on it thin out only along the sides of the rectangle around the
/// TIN; a vertex that the method leaves alone keeps its coordinates to the bit; may stop short, and
/// `note` says why. The mesh is in the TIN's frame and units.
///
/// Fails (unsupported) for cluster, for lines and for --side with a count; (invalid_argument) for
/// options that make no sense; with cancelled.
Result<Simplified> simplify_tin(const TerrainTin&, const SimplifyOptions&, const Progress& = {});

}  // namespace tind
