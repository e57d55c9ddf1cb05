#pragma once
// The terrain mesh that every method starts from: all posts of a grid, two triangles a cell.

#include "terrain/base/result.h"
#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/raster/height_grid.h"

namespace tind {

/// The full mesh of `grid` in POST coordinates (x = col, y = -row, z metres), each cell split from
/// its lower left to its upper right corner. A triangle with a void corner is left out, and so are
/// posts that no triangle uses. Where voids pinch the mesh to one post, that post becomes one
/// vertex for each fan, so that the result is a manifold. Without voids, vertex = row * cols + col.
/// Fails (invalid_argument) below 2 x 2 posts and (bad_data) when no triangle is left. O(posts).
Result<HalfedgeMesh> grid_mesh(const HeightGrid& grid);

/// The number of triangles that grid_mesh makes.
std::size_t grid_triangle_count(const HeightGrid& grid);

}  // namespace tind
