#pragma once
// A progressive mesh [Hoppe96]: a coarse base mesh and the list of vertex splits that lead from it
// to the fine one. Any prefix of the list is a valid mesh.
//
// Made from the collapses of any method, read backwards: collapse n-1 is split 0. Vertices are
// numbered so that a prefix needs no table: the base's are 0..b-1, split i adds vertex b + i.
//
// A split of `vertex` s with neighbours `left` l and `right` r: the triangles that lie around s
// counter-clockwise from l to r go over to the new vertex n, and two triangles (n, s, l) and
// (s, n, r) appear between. On the border r is kNone: the triangles from l to the end of the fan go
// over, one triangle appears.
//
// Positions are post coordinates (x = col, y = -row, z metres) for terrain.

#include <cstdint>
#include <vector>

#include "terrain/mesh/tin.h"

namespace tind {

struct VertexSplit {
  static constexpr std::uint32_t kNone = ~std::uint32_t(0);

  std::uint32_t vertex;  // the one that splits
  std::uint32_t left, right;
  Vec3 vertex_coarse;  // where it lies before the split ...
  Vec3 vertex_fine;    // ... and after
  Vec3 added;          // where the new vertex lies
  /// A bound on the vertical error, metres, of the mesh as it is before this split: never below
  /// the truth over all posts, never growing from split to split.
  float error_m;
};

struct ProgressiveMesh {
  Tin base;
  std::vector<VertexSplit> splits;
  double fine_error_m = 0;  // of the mesh after the last split
};

}  // namespace tind
