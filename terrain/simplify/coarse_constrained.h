#pragma once
// Where refinement starts when there are lines: the coarsest mesh that has all of them as edges.

#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/simplify/constraints.h"
#include "terrain/simplify/line_points.h"

namespace tind {

struct CoarseConstrained {
  HalfedgeMesh mesh;  // post coordinates; all of the rectangle, or what the boundary holds of it
  LinePoints lines;
  HeightGrid posts;  // what is still to be met: void at posts that lie on lines or too near them
};

/// The constrained Delaunay triangulation of the lines' ends and the rectangle's corners. Voids are
/// covered, as by every method that inserts. Fails (unsupported) without CGAL, (bad_data) when a
/// triangle is too thin to be worked on in floating point.
Result<CoarseConstrained> coarse_constrained(const Constraints&);

}  // namespace tind
