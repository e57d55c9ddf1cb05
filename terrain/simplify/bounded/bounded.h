#pragma once
// `bounded`: the fewest triangles for a given maximum error. (Our own method.)
//
// Methods that interpolate keep vertices on the surface and so waste half of the allowed band of
// error. Here a vertex floats: its height may be any that keeps every sample of its star within the
// band. Each sample allows an interval of heights, and the vertex needs a height in all of them;
// this test is exact. The steps:
// 1. Greedy insertion refines the mesh until every sample is within the band.
// 2. Every collapse for which the intervals intersect thins the mesh.
// 3. Vertices move to where the intersection is widest, and the mesh is thinned again.
//
// GUARANTEES: with --max-error M, every valid post lies within M of the mesh, in double precision
// (side both), or between the mesh and M below it (above), or M above it (below). Nothing flips.
// The result does not depend on the number of threads. With a triangle count, the error that is
// minimised is the root mean square (bounded_count.h). A count for one side only is met by a
// search over the error. COST: 1 to 1.5 x greedy insertion (fast), 2 to 4 x (normal), 6 to 16 x
// (best): see docs/methods.md.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/mesh/side.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/bounded/bounded_blocks.h"
#include "terrain/simplify/common/effort.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/samples.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

struct BoundedOptions {
  static constexpr const char* kName = "bounded";
  static constexpr const char* kVariant = "effort";
  Effort effort = Effort::normal;
  Side side = Side::both;

  template <class F>
  static void each_option(F&& option) {
    option("effort", &BoundedOptions::effort, "bounded: how hard to search");
    option("side", &BoundedOptions::side,
           "bounded: the mesh on both sides of the terrain, above, below");
  }
};

Result<Simplified> simplify_bounded(const Terrain& dem, const BoundedOptions&, const RunOptions&,
                                    const Progress&);

/// The same over samples anywhere, whose neighbours are about 1 apart: of a TIN of `triangles`,
/// that is, whose outline `start` covers. One thread. Fails (unsupported) for a count and one side
/// only.
Result<Simplified> simplify_bounded_samples(const Tin& start, ScatteredSamples, double x_scale,
                                            std::uint64_t triangles, const BoundedOptions&,
                                            const RunOptions&, const Progress&);

/// Whether simplify_bounded_rows can do it: a maximum error, no lines.
bool goes_by_rows(const RunOptions&);

/// The same mesh for a DEM that need not fit into memory: it holds a few rows of blocks of 512
/// posts, and the result.
Result<Simplified> simplify_bounded_rows(const HeightRows&, double spacing_x_m, double spacing_y_m,
                                         const BoundedOptions&, const RunOptions&, const Progress&);

}  // namespace tind
