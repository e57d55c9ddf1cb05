#pragma once
// From a coarse terrain mesh to a fine one of the same rectangle, without a pop and without a flip:
// [Yoon], "between two models", for height fields.
//
// The paper gives every coarse vertex a representative in the fine mesh and collapses the rest onto
// them, so that the coarse mesh's topology is what remains; where that is not possible it proposes
// vertex splits first. Here the fine mesh is split along the coarse one (overlay.h) until
// representatives and edges lie exactly where the coarse mesh has them. So the vertex sets are the
// coarse mesh's by construction, and a collapse onto a neighbour inside a coarse triangle or along
// a coarse edge cannot change that.
//
// Parameter s runs from 0, the coarse mesh, to 1, the fine surface. Two things happen on the way:
//   - every vertex rises from the coarse surface to the fine one: z = (1 - s) coarse + s fine
//   - the interior vertices appear one after the other, each sliding from the vertex that splits to
//     its own place: split i of n while s goes from i / n to (i + 1) / n
// A triangle's orientation is linear in the one moving vertex and not negative at both ends, so no
// mesh on the way has a flipped triangle. Vertices on the rectangle's border appear first, all at
// once as s leaves 0, already on the coarse line: the border at s is the mean of the two lines
// weighted by s and nothing else, so neighbours agree on it at every s.

#include <cstdint>
#include <stop_token>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"

namespace tind {

struct TerrainTransition {
  struct Vertex {
    double x = 0, y = 0, coarse_z = 0, fine_z = 0;
  };
  /// As VertexSplit of progressive_mesh.h: split i adds vertex base + i.
  struct Split {
    std::uint32_t vertex = 0, left = 0, right = 0;
  };

  std::vector<Vertex> vertices;  // the coarse mesh's in its order, then by split
  std::vector<Triangle> base;    // the coarse mesh's triangles
  std::vector<Split> splits;
  std::size_t border_splits = 0;  // the first ones
  std::size_t fine_vertices = 0;  // how many of the fine mesh; what is more was split in

  std::size_t base_vertices() const { return vertices.size() - splits.size(); }
};

/// Ends: at s = 0 the coarse mesh, vertex by vertex and triangle by triangle; at s = 1 the fine
/// mesh's vertices at their places and its surface, its triangles cut along the coarse mesh's
/// edges. REQUIRES: as overlay(). Fails (bad_data) with the place where the meshes cannot be
/// brought together, and (cancelled). Deterministic. O(n log n) beyond the overlay.
Result<TerrainTransition> terrain_transition(const Tin& fine, const Tin& coarse,
                                             const std::stop_token& = {});

/// The mesh at s, clamped to 0..1. Triangles are counter-clockwise; one that is just appearing may
/// have no area yet. O(vertices).
Tin mesh_at(const TerrainTransition&, double s);

}  // namespace tind
