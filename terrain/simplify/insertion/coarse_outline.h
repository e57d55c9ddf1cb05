#pragma once
// Where refinement of a TIN starts: its outline alone.

#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"
#include "terrain/simplify/common/terrain_mesh.h"

namespace tind {

/// The constrained Delaunay triangulation of what the terrain covers, holes left out, with those of
/// its border vertices that may not move along a side (VertexKind::fixed). A manifold, every
/// triangle counter-clockwise for certain. Fails (unsupported) without CGAL where the outline is no
/// rectangle, (bad_data) where the outline touches itself so that no triangulation has it, or
/// leaves a triangle without room.
Result<Tin> coarse_outline(const TerrainMesh&);

}  // namespace tind
