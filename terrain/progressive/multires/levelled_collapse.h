#pragma once
// The multi-triangulation of a height grid, made for refining: half-edge collapses in rounds.
//
// A round takes the cheapest share of all vertices and collapses an independent set of them, each
// into the neighbour that leaves the smallest error over the posts around it (measured, not
// estimated; [Berg98] for the levels, the exact star check of simplify/ for the
// cost). No two collapses of a round touch, so a node's ancestors lie in older rounds and close by:
// refining at one place forces little elsewhere. Vertices stay posts of the grid, and the finest
// mesh is the whole grid, with no error at all.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/progressive/multires/multi_triangulation.h"
#include "terrain/raster/terrain.h"

namespace tind {

struct LevelledOptions {
  std::size_t base_triangles = 256;  // collapse until so few are left, or no more may go
  double share = 0.4;                // of the vertices that a round looks at, the cheapest
  int threads = 1;                   // the result does not depend on it
};

/// Voids stay uncovered. Fails (invalid_argument) for less than 2 x 2
/// posts, (out_of_range) for more posts than a multi-triangulation can number, (bad_data) where
/// everything is void, (cancelled). O(posts log posts): about 7 microseconds a post.
Result<MultiTriangulation> levelled_terrain(const Terrain& dem, const LevelledOptions& = {},
                                            const Progress& = {});

}  // namespace tind
