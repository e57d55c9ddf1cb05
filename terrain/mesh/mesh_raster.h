#pragma once
// A mesh on the grid of its DEM: its heights, and how far they are from the posts.

#include "terrain/mesh/tin.h"
#include "terrain/raster/height_grid.h"

namespace tind {

struct MeshRaster {
  HeightGrid heights;  // of the mesh at each post, metres; void where no triangle covers it
  HeightGrid errors;   // mesh - post; void there, and where the DEM is void
};

/// `posts`: rows of the DEM from `first_row` on, all of its columns. `mesh` is in post coordinates,
/// y = -row. At a post on a shared edge the triangle with the larger error counts, as it does for
/// the referee (vertical_error.h). O(posts + triangles).
MeshRaster mesh_raster(const Tin& mesh, const HeightGrid& posts, int first_row, int threads = 1);

}  // namespace tind
