#pragma once
// How high lines are and how level polygons, and what becomes of the DEM's posts in between.

#include "terrain/simplify/constraint_network.h"

namespace tind {

/// Bilinear; over three corners where one is void, the mean of what is left otherwise; NaN far from
/// any valid post. REQUIRES: within the grid, which has at least 2 x 2 posts.
double height_between_posts(const HeightGrid&, double x, double y);

/// Gives the network's points their heights, `out` the levels of its flat polygons and the grid:
/// level inside these, void outside the boundary.
void give_heights(const HeightGrid&, const ConstraintShapes&, ConstraintNetwork&, Constraints& out);

}  // namespace tind
