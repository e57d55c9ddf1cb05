#pragma once
// Makes any triangle soup a manifold, so that it can be edited.

#include <cstddef>

#include "terrain/mesh/tin.h"

namespace tind {

struct ManifoldRepair {
  std::size_t split_vertices = 0;     // vertices added because several fans met in one
  std::size_t dropped_triangles = 0;  // degenerate, out of range, or a third one on an edge

  bool changed() const { return split_vertices + dropped_triangles > 0; }
};

/// Afterwards HalfedgeMesh::from_tin accepts the mesh. A vertex where several fans meet becomes one
/// vertex per fan (attributes are copied); an edge with more than two triangles, or with two that
/// run the same way, becomes border edges; what then still uses an edge twice is dropped. Positions
/// never change. O(n log n), deterministic.
ManifoldRepair make_manifold(Tin&);

/// Removes vertices that no triangle uses; the others keep their order. Returns how many went.
std::size_t drop_unused_vertices(Tin&);

/// Welds vertices that agree in position and all attributes (STL, and OBJ with repeated points).
/// Returns how many went. O(n log n).
std::size_t weld(Tin&);

}  // namespace tind
