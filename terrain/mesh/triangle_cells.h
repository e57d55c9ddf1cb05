#pragma once
// Triangles by the part of space that they pass through, for meshes whose triangles are as large as
// all of the mesh and go every way: no tree of boxes around whole triangles tells these apart.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "terrain/mesh/tin.h"

namespace tind {

class TriangleCells {
 public:
  /// Half of a half of a half ... of the box around the mesh, a little larger than that: what of a
  /// triangle lies in the half itself is as far from anywhere as the box at least.
  struct Cell {
    Vec3 low, high;
    std::size_t first = 0;    // of its two children in cells(); of a leaf in members()
    std::uint32_t count = 0;  // of a leaf's members
    bool leaf = true;
  };

  /// Of those triangles of the mesh, each of which is a member of all leaves that it passes through
  /// (and of some beside these). Takes time and memory for up to 64 memberships a triangle, at most
  /// some 16 million.
  TriangleCells(const Tin&, std::span<const std::uint32_t> triangles);

  /// The first is the root.
  const std::vector<Cell>& cells() const { return cells_; }
  /// Positions in `triangles`.
  const std::vector<std::uint32_t>& members() const { return members_; }

 private:
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> members_;
};

}  // namespace tind
