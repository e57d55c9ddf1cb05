#pragma once
// `triangle-collapse`: six triangles a step.
//
// The method of [Sung], "PMTC", on [Gieng97]. A step takes the triangle of least weight, merges its
// three corners into one vertex (four triangles go), then collapses the cheapest edge on the rim of
// the stencil, the ring of triangles around it (two more). One queue holds triangles only; the
// search for the edge is local.
//
// Weight: the quadric error at the triangle's centroid (on terrain, at the best height there),
// times a penalty for a valence above nine. The merged vertex goes to the centroid or to where the
// quadric is least (option `placement`). On the border a step merges one border edge instead of the
// triangle, and near the target it takes only what is still asked for.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

/// Reads `placement` ("quadric" | "centroid") and `stop`.
Result<Simplified> simplify_triangle_collapse(const Terrain& dem, const SimplifyOptions&,
                                              const Progress&);

/// The same for a general manifold mesh; positions only.
Result<Simplified> triangle_collapse_mesh(const Tin&, const SimplifyOptions&, const Progress&);

}  // namespace tind
