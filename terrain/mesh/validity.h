#pragma once
// Is this a valid terrain mesh? (Promise 4: nothing flips, nothing is missing.)

#include <cstddef>
#include <string>

#include "terrain/mesh/tin.h"

namespace tind {

struct MeshValidity {
  std::size_t flipped = 0;       // triangles that are clockwise or have no area, seen from above
  std::size_t bad_indices = 0;   // triangles that name a vertex that is not there, or one twice
  std::size_t non_manifold = 0;  // directed edges used twice, vertices whose fan falls apart
  std::size_t border_edges = 0;  // edges with one triangle
  std::size_t unused_vertices = 0;
  double area = 0;            // sum of signed areas, in the mesh's own xy units squared
  std::string first_problem;  // one line; empty when valid

  bool ok() const { return flipped + bad_indices + non_manifold == 0; }
};

/// O(n). Looks at the mesh alone; whether it covers a given DEM is the referee's to say
/// (vertical_error.h, `uncovered`).
MeshValidity check_validity(const Tin&);

}  // namespace tind
