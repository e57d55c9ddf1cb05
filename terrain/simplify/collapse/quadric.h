#pragma once
// Quadric error metrics ([Garland97]; [Han04] and [Min] build on them), the method `qem`.
//
// A vertex carries the area-weighted sum of the squared distances to the planes of all triangles
// that were ever merged into it. A collapse adds two such sums and goes to the point where the sum
// is least. A vertex on a side of the rectangle stays on that side; corners and vertices at voids
// stay where they are.
//
// Options:
//   subset_placement    the merged vertex is one of the two ends, so all heights are samples
//   border_constraints  border edges also carry a plane through the edge and perpendicular to their
//                       triangle, which keeps the border's profile

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

struct HeldMesh;

struct QemOptions {
  static constexpr const char* kName = "qem";
  static constexpr bool kTellsCollapses = true;
  bool subset_placement = false;
  bool border_constraints = false;

  template <class F>
  static void each_option(F&& option) {
    option("subset-placement", &QemOptions::subset_placement,
           "qem: keep a subset of the posts as vertices");
    option("border-constraints", &QemOptions::border_constraints, "qem: hold the border's profile");
  }
};

Result<Simplified> simplify_qem(const Terrain& dem, const QemOptions&, const RunOptions&,
                                const Progress&);

/// The same on a mesh whose border is held, as far as its bound and its count allow. Returns the
/// steps. The options have passed check_method.
Result<std::uint64_t> collapse_held(HeldMesh&, const QemOptions&, const Progress&);

}  // namespace tind
