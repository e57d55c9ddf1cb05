#pragma once
// Gives heights to lines and levels to polygons, and adapts the posts of the DEM to them.

#include "terrain/raster/height_grid.h"
#include "terrain/simplify/constraints/constraint_network.h"

namespace tind {

/// height_between (interpolate.h), the height that everything else has there. Where that is void a
/// line's point needs one all the same, or the line would end: then the plane of the three posts
/// around that are not void goes on, else their mean counts; NaN far from any valid post.
/// REQUIRES: within the grid, which has at least 2 x 2 posts.
double height_between_posts(const HeightGrid&, double x, double y);

/// Gives the network's points their heights, `out` the levels of its flat polygons and the grid:
/// level inside these, void outside the boundary.
void give_heights(const HeightGrid&, const ConstraintShapes&, ConstraintNetwork&, Constraints& out);

}  // namespace tind
