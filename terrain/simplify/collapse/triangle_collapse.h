#pragma once
// `triangle-collapse`: removes six triangles in each step.
//
// The method of [Sung], "PMTC", based on [Gieng97]. A step takes the triangle of least weight and
// merges its three corners into one vertex, which removes four triangles. Then it collapses the
// cheapest edge on the rim of the ring of triangles around it, which removes two more. One queue
// holds only triangles; the search for the edge is local.
//
// Weight: the quadric error at the triangle's centroid (on terrain, at the best height there),
// times a penalty for a valence above nine. The merged vertex goes to the centroid or to where the
// quadric is least (option `placement`). On the border, a step merges one border edge instead of
// the triangle. Near the target, a step removes only as many triangles as are still needed.

#include "terrain/base/enum_names.h"
#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

struct HeldMesh;

/// Reads `placement` ("quadric" | "centroid") and `stop`.
/// Where the merged vertex goes.
enum class Placement { quadric, centroid };

template <>
struct EnumNames<Placement> {
  static constexpr const char* kWhat = "placement of triangle-collapse";
  static constexpr std::pair<Placement, const char*> kAll[] = {{Placement::quadric, "quadric"},
                                                               {Placement::centroid, "centroid"}};
};

struct TriangleCollapseOptions {
  static constexpr const char* kName = "triangle-collapse";
  static constexpr bool kTellsCollapses = true;
  static constexpr const char* kVariant = "placement";
  Placement placement = Placement::quadric;

  template <class F>
  static void each_option(F&& option) {
    option("placement", &TriangleCollapseOptions::placement,
           "triangle-collapse: where the merged vertex goes");
  }
};

Result<Simplified> simplify_triangle_collapse(const Terrain& dem, const TriangleCollapseOptions&,
                                              const RunOptions&, const Progress&);

/// The same for a general manifold mesh; positions only.
Result<Simplified> triangle_collapse_mesh(const Tin&, const TriangleCollapseOptions&,
                                          const RunOptions&, const Progress&);

/// The same on a mesh whose border is held, as far as its bound and its count allow. Returns the
/// steps. The options have passed check_method.
Result<std::uint64_t> collapse_held(HeldMesh&, const TriangleCollapseOptions&, const Progress&);

}  // namespace tind
