#pragma once
// How far is a mesh from the surface between the posts? vertical_error() knows posts only, and the
// mesh between two of them may cut off a ridge.

#include "terrain/geo/coordinates.h"
#include "terrain/mesh/tin.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/raster/height_grid.h"

namespace tind {

/// The largest distances of a mesh from the surface through the posts, over all of its area.
struct SurfaceError {
  double max_above_m = 0, max_below_m = 0;  // mesh above the surface / below it, both >= 0
  Vec2 at = {-1, -1};                       // where the larger one is: column, row; -1: nowhere

  double max_m() const { return max_above_m > max_below_m ? max_above_m : max_below_m; }
};

/// Measures `mesh`, whose x, y are POST coordinates with y = -row, against the surface through the
/// posts of `grid`: bilinear in a cell of four, a plane over three where one is void
/// (raster/interpolate.h). Where that is not, nothing is measured. `at_posts`: what
/// vertical_error() says of the two. No sample: all of the area, but for rounding.
///
/// Why few places are enough. Inside one triangle and one cell, the difference of the two surfaces
/// has no extreme (a saddle at most), and along rows and columns it is linear between posts and
/// edges. What is left are the posts and the triangles' edges, along which it is a parabola a
/// cell. O(T log T + cells that edges cross); 8 bytes an edge.
SurfaceError surface_error(const Tin& mesh, const HeightGrid& grid, const VerticalError& at_posts,
                           int threads = 1);

}  // namespace tind
