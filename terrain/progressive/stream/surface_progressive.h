#pragma once
// From a general mesh (a scanned model, a building) to a progressive mesh, as make_progressive.h
// does from a DEM.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/progressive/stream/progressive_mesh.h"
#include "terrain/progressive/stream/space_lattice.h"
#include "terrain/simplify/options.h"

namespace tind {

struct ProgressiveSurface {
  /// Errors are in the mesh's own unit, and bounds on the distance of two
  /// surfaces (displacement.h).
  ProgressiveMesh mesh;
  std::size_t split_vertices = 0;  // what had to be done to make the input a manifold
  std::size_t dropped_triangles = 0;
};

/// The fine end is the mesh itself with its vertices on `lattice`, the coarse end what `method`
/// (qem, attribute-qem or triangle-collapse) makes of it with `base_triangles` triangles, or as few
/// as it can. Attributes steer attribute-qem and are not kept. GUARANTEES: every prefix is a
/// manifold of the input's topology, borders stay borders, all positions lie on the lattice, and no
/// normal turns by 90 degrees or more in one step. Fails as simplify_mesh does.
Result<ProgressiveSurface> make_progressive_surface(Tin, const SimplifyOptions& method,
                                                    std::size_t base_triangles,
                                                    const SpaceLattice& lattice,
                                                    const Progress& progress = {});

}  // namespace tind
