#pragma once
// `attribute-qem`: quadrics over position and attributes together, so that colour borders, textures
// and shading survive at the same triangle count.
//
// [Han04] and [Min], "EQEM", after [Garland98]. A vertex is a point of R^N: position, then texture
// (N = 5), colour or normal (6), or colour and normal (9). The quadric of a triangle is the squared
// distance to its plane in R^N (quadric_n.h). A collapse goes to the point where the sum of two
// quadrics is least, and takes the attributes from there: colours are clamped to 0..1, normals are
// scaled to unit length. A dimensionless weight, relative to the diagonal of the bounding box, sets
// attributes against position.
//
// `attribute_metric` says how attributes take part:
//   joint     as in EQEM
//   separate  as in progressive meshes [Hoppe96]: the quadric of the shape, plus the squared change
//             of the attributes. Attributes do not move the vertex
//   ignored   only the shape counts (`qem`); attributes are carried along

#include <span>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

/// On terrain: normals from the DEM's slope, and the colours of `drape` if given (one a post). The
/// result carries both.
Result<Simplified> simplify_attribute_qem(const Terrain& dem, const SimplifyOptions&,
                                          const Progress&);

/// A general manifold mesh with its own attributes. Normals are computed when `attributes` asks for
/// them and the mesh has none.
Result<Simplified> attribute_qem_mesh(const Tin&, const SimplifyOptions&, const Progress&);

/// Unit normals of the vertices, weighted by area.
std::vector<std::array<float, 3>> vertex_normals(const Tin&);

/// The full terrain mesh in metres (x = col * spacing, y = -row * spacing) with its attributes:
/// what attribute errors are measured against.
Result<Tin> terrain_with_attributes(const Terrain& dem, const SimplifyOptions&);

}  // namespace tind
