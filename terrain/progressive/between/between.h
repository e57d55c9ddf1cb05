#pragma once
// A progressive mesh between two models of one surface that somebody else made [Yoon]:
// its coarse end is exactly the coarse model, its fine end the fine one.
//
//   1. each coarse vertex gets a representative: the nearest fine vertex, all distinct
//   2. vertex sets grow around them, by number of edges
//   3. the sets are made to touch exactly where the coarse model has edges (vertex_sets.h)
//   4. edges collapse inside the sets, by quadric error, under the link condition
//   5. with each collapse the surviving vertex moves on, linearly, to where the coarse model has it

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/progressive/stream/progressive_mesh.h"
#include "terrain/progressive/stream/space_lattice.h"

namespace tind {

struct BetweenModels {
  /// base: the coarse model as given, vertex by vertex and triangle by triangle. `error_m` of a
  /// split: no vertex of the fine model is farther than this from the vertex that stands for it.
  ProgressiveMesh mesh;
  /// Vertices added on the fine model's edges first, which changes its triangles but not its
  /// surface: where a path had no way round (the paper's open cases), or where a set had one vertex
  /// only and so no collapse in which to move.
  std::size_t split_in = 0;
  std::size_t turned = 0;  // triangles_turned(mesh)
};

/// Connected, orientable manifolds with as many handles and borders. Borders lead to borders:
/// border vertices go along the border only. Spheres and discs succeed unless they are so unlike
/// that the paths would need ever more vertices. Fails (invalid_argument) when the two are not of
/// that kind, (unsupported) when that happens, or when on a model with handles an edge finds no way
/// or the collapses end elsewhere; with the place. With a `lattice` all places lie on it, also
/// those of the ends, which are exact where it holds them. Deterministic. O(coarse edges x n log
/// n).
Result<BetweenModels> between_models(const Tin& fine, const Tin& coarse,
                                     const SpaceLattice* lattice = nullptr,
                                     const Progress& progress = {});

/// How many triangles that a split leaves turn by 90 degrees or more when it is made, over all
/// splits. Where none does, none faces another way at any moment of any split's geomorph either: a
/// triangle has one corner that moves, so its normal is on the straight line between both ends.
std::size_t triangles_turned(const ProgressiveMesh&);

}  // namespace tind
