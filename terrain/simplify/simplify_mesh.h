#pragma once
// Simplifies a general mesh (a scanned model, a building), as simplify.h does a DEM.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/options.h"

namespace tind {

struct SimplifiedMesh {
  Simplified made;
  std::size_t split_vertices = 0;  // what had to be done to make the input a manifold
  std::size_t dropped_triangles = 0;
  std::size_t seam_vertices = 0;  // of the input, that stay where they are
};

/// Whether simplify_mesh takes the method.
bool takes_meshes(const MethodOptions&);

/// Vertices that agree in all that they have are one. Where those of a border lie at one place with
/// other attributes (a seam), they stay there, so that no crack opens; `triangle-collapse`, which
/// carries no attributes, knows no seams.
///
/// Methods: `qem`, `attribute-qem`, `triangle-collapse`. Stops at a triangle count or a ratio. The
/// result is a manifold, and no triangle's normal has turned by 90 degrees or more in one step.
/// Fails (invalid_argument) for other methods and stops, (bad_data) for a mesh without triangles.
Result<SimplifiedMesh> simplify_mesh(Tin, const SimplifyOptions&, const Progress& = {});

}  // namespace tind
