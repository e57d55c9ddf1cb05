#pragma once
// `vertex-removal`: removes vertices one by one and triangulates each hole again.
//
// The method of [Schroeder92]. [Kim] uses it as a baseline, with three criteria for which vertex
// goes first:
//   plane      the vertex nearest to the average plane of its ring (on the border: to the line
//              through its border neighbours), in metres
//   degree     the vertex with the fewest edges
//   k-degree   the same; ties go to the vertex whose `k` lowest neighbours have the fewest edges
// All vertices of the result are posts of the source.
//
// The hole is filled with the ears of a Delaunay triangulation of the ring ([Devillers99]: the ear
// of least power first). A border vertex may be removed only where the border runs straight on, so
// the outline never changes; corners stay. The order is smallest first, to within one bucket
// (BucketQueue), in rounds: the ring of a removed vertex waits for the next round, so that equal
// vertices thin out evenly.

#include "terrain/base/enum_names.h"
#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

struct HeldMesh;

/// Reads `criterion`, `k` (1..16) and `stop` of the options. A removal that would move the surface
/// past `max_error_m` at any post is refused, and the vertex is tried again once its ring changes.
/// Fails (invalid_argument) on an unknown criterion or a k out of range.
/// Which vertices go first: see above.
enum class Criterion { plane, degree, k_degree };

template <>
struct EnumNames<Criterion> {
  static constexpr const char* kWhat = "criterion";
  static constexpr std::pair<Criterion, const char*> kAll[] = {{Criterion::plane, "plane"},
                                                               {Criterion::degree, "degree"},
                                                               {Criterion::k_degree, "k-degree"}};
};

struct VertexRemovalOptions {
  static constexpr const char* kName = "vertex-removal";
  static constexpr const char* kVariant = "criterion";
  Criterion criterion = Criterion::plane;
  int k = 6;  // k-degree: neighbours that break a tie

  template <class F>
  static void each_option(F&& option) {
    option("criterion", &VertexRemovalOptions::criterion,
           "vertex-removal: which vertices go first");
    option("k", &VertexRemovalOptions::k,
           "vertex-removal by k-degree: neighbours that break a tie");
  }
};

Result<Simplified> simplify_vertex_removal(const Terrain& dem, const VertexRemovalOptions&,
                                           const RunOptions&, const Progress&);

/// Fails (invalid_argument) on a k out of range.
Result<void> check_method(const VertexRemovalOptions&);

/// The same on a mesh whose border is held, as far as its bound and its count allow. Returns the
/// steps. The options have passed check_method.
Result<std::uint64_t> collapse_held(HeldMesh&, const VertexRemovalOptions&, const Progress&);

}  // namespace tind
