#pragma once
// Sorts a tile's triangles so that its encoded bytes are few.

#include <vector>

#include "terrain/mesh/tin.h"

namespace tind {

/// The same triangles, each as near as may be to the one before it, and turned so that its newest
/// vertex comes last: a walk over the mesh from edge to edge. Vertices numbered by first use then
/// lie close to the one before (small deltas), and the high-water-mark code is mostly 0 and small
/// numbers. Deterministic. O(n). REQUIRES: a manifold.
std::vector<Triangle> coherent_order(const Tin&);

}  // namespace tind
