#pragma once
// Two triangulations of one rectangle laid over each other: a mesh that refines both.

#include <stop_token>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/mesh/halfedge_mesh.h"

namespace tind {

/// Both surfaces are exact on it: every edge of either runs along edges of the overlay. Vertices
/// never move in x and y, so it can take any height between the two, and nothing flips.
struct Overlay {
  using Index = HalfedgeMesh::Index;
  static constexpr Index kInside = ~Index(0);    // of `line`: inside a coarse triangle
  static constexpr Index kCorner = kInside - 1;  // a coarse vertex
  static constexpr Index kSide = kInside - 2;    // on the rectangle's border

  HalfedgeMesh mesh;             // z: the fine surface; the first slots are the fine vertices
  std::vector<double> coarse_z;  // by slot: the coarse surface there
  std::vector<Index> corner;     // by coarse vertex: its slot
  std::vector<Index> line;       // by slot: kInside, kCorner, kSide or the coarse edge it lies on
  std::size_t fine_vertices = 0;

  // By coarse edge that is not on the border: its two ends, as slots.
  std::vector<std::array<Index, 2>> edge;
};

/// REQUIRES: both cover the same rectangle with counter-clockwise triangles, corners included. On
/// each side heights depend on the two lines of that side alone, computed from its lower end
/// (x or y) on: two overlays that share a side agree on it to the last bit.
/// Fails (bad_data) with the place where the two cannot be laid over each other in double
/// precision, and (cancelled). O(n sqrt n) typically.
Result<Overlay> overlay(const Tin& fine, const Tin& coarse, const std::stop_token& = {});

}  // namespace tind
