#pragma once
// Where a height may be: between which lines the true contour must lie, when what is known of the
// terrain is a mesh or tiles, and how wrong they are.
//
// Both bound their error at posts; between posts a mesh may cut off a ridge, and be much farther
// from the DEM. So this takes the mesh's heights at the posts alone, as level_dem.h does, and says
// why that is enough. What is certain is then as sharp as the mesh is at posts.
//
// The terrain is somewhere between two surfaces over the same triangles, `low` and `high`. It can
// have the height c only where low <= c <= high. In a triangle both are planes, so that this is a
// convex piece between two parallel cuts; the pieces of all triangles make polygons, whose corners
// lie on the mesh's edges, where both neighbours compute them from the same two numbers. Nothing is
// snapped: what borders what is known by name, not by place.

#include <span>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"
#include "terrain/raster/contour_lines.h"
#include "terrain/raster/height_grid.h"

namespace tind {

/// A surface of triangles, x, y POST coordinates with y = -row, between whose two heights at each
/// vertex the terrain is, also inside of the triangles.
struct BoundedSurface {
  Tin mesh;
  /// One a vertex, metres; low < high, but for vertices of no triangle.
  std::vector<double> low, high;
};

/// Posts of which each is within `error_m` of the terrain's, which is bilinear between its own. A
/// cell's two triangles leave the bilinear surface by a quarter of what its corners are out of one
/// plane, at most; that is added at its corners. Over three posts, where the fourth is void, it is
/// their triangle (raster/interpolate.h).
BoundedSurface bounded_surface(const HeightGrid& posts, double error_m);

/// The areas of these heights, each in ascending order of heights. Fails (cancelled).
/// O(T log T + sum over heights of the triangles that can have it).
Result<std::vector<ContourArea>> contour_bands(const BoundedSurface&,
                                               std::span<const double> heights_m,
                                               const Progress& = {});

}  // namespace tind
