#pragma once
// `attribute-qem`: quadrics over position and attributes at once, so that colour borders, textures
// and shading survive at the same triangle count.
//
// [Han04] and [Min], "EQEM", after [Garland98]. A vertex is a point of R^N: position, then texture
// (N = 5), colour or normal (6), or colour and normal (9). The quadric of a triangle is the squared
// distance to its plane in R^N (quadric_n.h); a collapse goes where the sum of two is least, and
// takes the attributes from there: colours are clamped to 0..1, normals made unit again. Attributes
// count against position by a dimensionless weight, relative to the diagonal of the bounding box.
//
// `attribute_metric` says how attributes take part:
//   joint     EQEM
//   separate  as progressive meshes do [Hoppe96]: the shape's quadric, plus the squared change
//   of
//             the attributes; they do not move the vertex
//   ignored   the shape alone decides (`qem`); attributes are carried along

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
