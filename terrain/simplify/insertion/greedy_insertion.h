#pragma once
// `greedy`: greedy insertion into a Delaunay triangulation [Garland95]. It starts from two
// triangles. The worst sample becomes a vertex, again and again, until no error is above the limit
// or the count is reached. Vertices are posts. GIS tools use this method; for `bounded` it is the
// baseline.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/samples.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

/// O(n log n) expected. GUARANTEES with --max-error M: every valid post within M of the mesh, to
/// the rounding of doubles (1e-12 of the relief).
struct GreedyOptions {
  static constexpr const char* kName = "greedy";

  template <class F>
  static void each_option(F&&) {}
};

Result<Simplified> simplify_greedy(const Terrain& dem, const GreedyOptions&, const RunOptions&,
                                   const Progress&);

/// The same over samples anywhere, whose neighbours are about 1 apart: of a TIN of `triangles`,
/// that is, whose outline `start` covers.
Result<Simplified> simplify_greedy_samples(const Tin& start, const ScatteredSamples&,
                                           double x_scale, std::uint64_t triangles,
                                           const RunOptions&, const Progress&);

}  // namespace tind
