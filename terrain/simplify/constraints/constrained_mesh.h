#pragma once
// The full-resolution mesh of a DEM in which the parts of a network of lines are edges.

#include "terrain/base/result.h"
#include "terrain/raster/height_grid.h"
#include "terrain/simplify/constraints/constraint_network.h"

namespace tind {

/// Fills mesh, hold, parts and inner of `out`, whose grid is given. Only cells near lines are
/// triangulated anew; all other cells keep their two triangles.
Result<void> make_constrained_mesh(const HeightGrid&, const ConstraintNetwork&, Constraints& out);

}  // namespace tind
