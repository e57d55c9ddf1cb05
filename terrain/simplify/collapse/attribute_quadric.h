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
// AttributeMetric says how attributes take part:
//   joint     as in EQEM
//   separate  as in progressive meshes [Hoppe96]: the quadric of the shape, plus the squared change
//             of the attributes. Attributes do not move the vertex
//   ignored   only the shape counts (`qem`); attributes are carried along

#include <span>

#include "terrain/base/enum_names.h"
#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

struct HeldMesh;

/// Which attributes take part.
enum class AttributeChoice { automatic, texture, colour, normal, colour_and_normal };

template <>
struct EnumNames<AttributeChoice> {
  static constexpr const char* kWhat = "choice of attributes";
  static constexpr std::pair<AttributeChoice, const char*> kAll[] = {
      {AttributeChoice::automatic, "auto"},
      {AttributeChoice::texture, "texture"},
      {AttributeChoice::colour, "colour"},
      {AttributeChoice::normal, "normal"},
      {AttributeChoice::colour_and_normal, "colour+normal"}};
};

/// How they do: see above.
enum class AttributeMetric { joint, separate, ignored };

template <>
struct EnumNames<AttributeMetric> {
  static constexpr const char* kWhat = "attribute metric";
  static constexpr std::pair<AttributeMetric, const char*> kAll[] = {
      {AttributeMetric::joint, "joint"},
      {AttributeMetric::separate, "separate"},
      {AttributeMetric::ignored, "ignored"}};
};

struct AttributeQemOptions {
  static constexpr const char* kName = "attribute-qem";
  static constexpr bool kTellsCollapses = true;
  static constexpr const char* kVariant = "attribute-metric";
  AttributeChoice attributes = AttributeChoice::automatic;
  AttributeMetric metric = AttributeMetric::joint;
  double weight = 1;  // against position; 1 is the measured default
  std::shared_ptr<const std::vector<std::array<float, 3>>>
      drape;  // terrain: a colour for each post

  template <class F>
  static void each_option(F&& option) {
    option("attributes", &AttributeQemOptions::attributes,
           "attribute-qem: which attributes take part");
    option("attribute-metric", &AttributeQemOptions::metric,
           "attribute-qem: joint with the shape, separate as in progressive meshes, ignored");
    option("attribute-weight", &AttributeQemOptions::weight,
           "attribute-qem: attributes against position; 1 is the measured default");
    option("drape", &AttributeQemOptions::drape, "attribute-qem: colours from this image");
  }
};

/// Whether `attributes` names the normals.
inline bool asks_for_normals(const AttributeQemOptions& o) {
  return o.attributes == AttributeChoice::normal ||
         o.attributes == AttributeChoice::colour_and_normal;
}

/// On terrain: normals from the DEM's slope, and the colours of `drape` if given (one a post). The
/// result carries both.
Result<Simplified> simplify_attribute_qem(const Terrain& dem, const AttributeQemOptions&,
                                          const RunOptions&, const Progress&);

/// A general manifold mesh with its own attributes. Normals are computed when `attributes` asks for
/// them and the mesh has none.
Result<Simplified> attribute_qem_mesh(const Tin&, const AttributeQemOptions&, const RunOptions&,
                                      const Progress&);

/// Unit normals of the vertices, weighted by area.
std::vector<std::array<float, 3>> vertex_normals(const Tin&);

/// The full terrain mesh in metres (x = col * spacing, y = -row * spacing) with its attributes:
/// what attribute errors are measured against.
Result<Tin> terrain_with_attributes(const Terrain& dem, const AttributeQemOptions&,
                                    const Constraints*);

/// The same on a mesh whose border is held, as far as its bound and its count allow. Returns the
/// steps. The options have passed check_method.
Result<std::uint64_t> collapse_held(HeldMesh&, const AttributeQemOptions&, const Progress&);

}  // namespace tind
