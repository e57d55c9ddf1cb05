#pragma once
// Makes any triangle soup a manifold, so that it can be edited.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "terrain/mesh/tin.h"

namespace tind {

/// In which order split_fans appends copies: of their fans' first corners, or of the vertices that
/// they are copies of (and where one vertex has several, of first corners).
enum class CopyOrder { of_corners, of_vertices };

/// One vertex per fan. Where several fans of triangles meet in a vertex, the one with the first
/// corner keeps it, and each other gets a copy (of the attributes, too), appended. Triangles belong
/// to one fan when they share an edge that these two alone use, in opposite directions. Returns for
/// each copy the vertex that it is one of. REQUIRES: no triangle names a vertex twice, or one that
/// is not there. O(n log d), d being the largest number of triangles at a vertex.
std::vector<std::uint32_t> split_fans(Tin&, CopyOrder);

struct ManifoldRepair {
  std::size_t split_vertices = 0;     // vertices added because several fans met in one
  std::size_t dropped_triangles = 0;  // degenerate, out of range, twice, or a third one on an edge
  /// By added vertex: the one of the input that it is a copy of.
  std::vector<std::uint32_t> copy_of = {};

  bool changed() const { return split_vertices + dropped_triangles > 0; }
};

/// Afterwards HalfedgeMesh::from_tin accepts the mesh. Of triangles with the same corners in the
/// same sense one stays. A vertex where several fans meet becomes one
/// vertex per fan (attributes are copied); an edge with more than two triangles, or with two that
/// run the same way, becomes border edges; what then still uses an edge twice is dropped. Positions
/// never change. O(n log n), deterministic.
ManifoldRepair make_manifold(Tin&);

/// Has a vertex more than its place: a colour, a normal, texture coordinates?
bool has_attributes(const Tin&);
void drop_attributes(Tin&);

/// Removes vertices that no triangle uses; the others keep their order. Returns how many went.
std::size_t drop_unused_vertices(Tin&);

/// Welds vertices that agree in position and all attributes (STL, and OBJ with repeated points).
/// Returns how many went. O(n log n).
std::size_t weld(Tin&);

}  // namespace tind
