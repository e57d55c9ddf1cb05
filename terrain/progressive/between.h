#pragma once
// A progressive mesh between two models of one surface that somebody else made (papers/002: Yoon,
// Choi, Lee): its coarse end is exactly the coarse model, its fine end the fine one.
//
//   1. each coarse vertex gets a representative: the nearest fine vertex, all distinct
//   2. vertex sets grow around them, by number of edges
//   3. the sets are made to touch exactly where the coarse model has edges (vertex_sets.h)
//   4. edges collapse inside the sets, by quadric error, under the link condition
//   5. with each collapse the surviving vertex moves on, linearly, to where the coarse model has it

#include "terrain/base/result.h"
#include "terrain/progressive/progressive_mesh.h"

namespace tind {

struct BetweenModels {
  /// base: the coarse model as given, vertex by vertex and triangle by triangle. `error_m` of a
  /// split: no vertex of the fine model is farther than this from the vertex that stands for it.
  ProgressiveMesh mesh;
  /// Vertices added on the fine model's edges first, which changes its triangles but not its
  /// surface: where a path had no way round (the paper's open cases), or where a set had one vertex
  /// only and so no collapse in which to move.
  std::size_t split_in = 0;
};

/// Closed, connected, orientable manifolds of the same genus; a sphere always succeeds. Fails
/// (invalid_argument) when the two are not of that kind, (unsupported), with the place, when on a
/// model with handles an edge finds no way or the collapses end elsewhere. Deterministic.
/// O(coarse edges x n log n).
Result<BetweenModels> between_models(const Tin& fine, const Tin& coarse);

}  // namespace tind
