#pragma once
// The methods of simplification as makers of tiles, all but `bounded`: from a tile's frame and its
// posts to a mesh in the tile's own grid, with the frame as it was.
//
// Every method keeps what `bounded` keeps: the frame's vertices (border, lattice, lines) stay to
// the bit, vertices stand on whole numbers and heights on the lattice's step, orientation is
// decided in these integers, and no sample may get farther from the mesh than the bound, whatever
// the method thinks of it.

#include <memory>

#include "terrain/base/progress.h"
#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/mesh/tin.h"
#include "terrain/simplify/bounded/bounded_mesher.h"
#include "terrain/simplify/common/held_colours.h"
#include "terrain/simplify/common/samples.h"
#include "terrain/simplify/insertion/line_points.h"
#include "terrain/simplify/options.h"

namespace tind {

/// The mesh that `method` makes of a tile's frame and the samples. `kept`: lines of the frame whose
/// edges stay; null: none. Of `o` all that is no matter of effort. `metres_per_unit`: of v; of u
/// times o.x_scale. `colours`: what vertices are to show, of which attribute-qem takes notice;
/// null: nothing. Collapsing methods start from the frame with every sample as a vertex, so near
/// the border the mesh may miss `o.eps` where the frame itself does: callers measure. When stopped,
/// the mesh is whatever it is. REQUIRES: check_tile_method; not bounded. O(n log n).
template <class Samples>
Tin mesh_by_method(const MethodOptions& method, HalfedgeMesh frame, LinePoints* kept,
                   const Samples& samples, const MesherOptions& o, double metres_per_unit,
                   const Progress& progress, std::shared_ptr<const HeldColours> colours = {});

}  // namespace tind
