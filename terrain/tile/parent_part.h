#pragma once
// The part of a parent tile that one of its children covers (one of its four quadrants), as a mesh
// of its own: the parent's triangles are cut along its middle lines.

#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/mesh/tin.h"

namespace tind {

/// `parent`: x, y in the parent's lattice (0..32767), z metres. The result lies in the child's
/// lattice: twice the parent's numbers, less 32767 in its east and north halves; so the parent's
/// vertices come to stand on whole numbers and the cuts on the child's sides, exactly.
///
/// A cut is computed from the two ends of its edge in the order of their positions, east-west
/// first: siblings, and children of the parent's neighbour, get the same bits. O(triangles log
/// triangles). Fails (bad_data) where the parent is not a valid mesh of its square.
Result<Tin> parent_part(const Tin& parent, TileId child);

}  // namespace tind
