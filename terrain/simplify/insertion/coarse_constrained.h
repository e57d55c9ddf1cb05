#pragma once
// Meshes that start from lines rather than from the full mesh: the constrained Delaunay
// triangulation of the points kept of each line, and of any other points.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/raster/height_grid.h"
#include "terrain/simplify/constraints/constraints.h"
#include "terrain/simplify/insertion/line_points.h"

namespace tind {

/// Vertices of Constraints::mesh along one straight part, from its first to its last.
using LineChain = std::vector<std::uint32_t>;

struct TriangulatedLines {
  Tin tin;                                          // post coordinates, a manifold
  std::vector<std::array<std::uint32_t, 2>> edges;  // of tin, per chain, in order; kNone: not there
};

/// Covers the rectangle, or what the boundary holds of it, voids too. A point that would leave a
/// triangle without area in floating point is left out. Fails (unsupported) without CGAL,
/// (bad_data) when the chains alone leave such a triangle.
Result<TriangulatedLines> triangulate_lines(const Constraints&, std::span<const LineChain>,
                                            std::span<const Vec3> points);

struct CoarseConstrained {
  HalfedgeMesh mesh;
  LinePoints lines;
  HeightGrid posts;  // what is still to be met: void at posts that lie on lines or too near them
};

/// Where refinement starts: only the lines' ends and the rectangle's corners.
Result<CoarseConstrained> coarse_constrained(const Constraints&);

}  // namespace tind
