#pragma once
// After the collapse: the same number of triangles, so that their vertices show an image's colours
// better.
//
// In turns, edges are flipped and vertices moved aside where that lowers the colours' squared error
// (HeldColours::error) around them and the mesh's own filter allows it. A vertex that moves gets
// the height that fits its star's samples best.

#include "terrain/base/progress.h"
#include "terrain/simplify/common/held_mesh.h"

namespace tind {

/// What is held stays; so do the bound, the orientation and the number of triangles. Does nothing
/// to a mesh without colours, and stops early when told to. The colours' error never grows.
void fit_to_colours(HeldMesh&, const Progress&);

}  // namespace tind
