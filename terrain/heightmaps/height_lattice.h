#pragma once
// Heights of a surface at the posts of a raster that somebody else asks for: each the mean of H
// over the cell around its post.

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/surface/surface.h"

namespace tind {

/// Where a raster's posts are.
struct RasterLattice {
  int cols = 0, rows = 0;  // columns from the west, rows from the north
  Vec2 spacing_m{1, 1};    // ground distance of neighbours in a row, in a column
  /// The places of a row's columns first, first + 1, ...: as many as there is room for. Fractions
  /// lie between the posts, half a post beyond the outermost, too. Thread-safe.
  std::function<void(double row, double first, std::span<Geographic>)> places;
};

struct LatticeOptions {
  /// Where no place of a cell has a height, voids are filled as in tiles of meshes (void_fill.h):
  /// near heights the nearest, sloping to 0 farther away. Else such a post is NaN.
  bool fill = false;
  int threads = 0;  // 0: one per core
  /// Posts of all layers that a thread has in memory at a time. The heights do not depend on it.
  std::int64_t most_held = std::int64_t(1) << 24;
};

struct LatticeHeights {
  std::vector<float> heights;  // metres, rows from the north
  int samples = 1;             // of H a post
  /// Of all samples of H: the farthest from its post's mean, metres. 0 with one sample.
  double max_deviation_m = 0;
  std::uint64_t without_height = 0;  // posts: none of their samples has a height
};

/// A post is the mean of H at places spread evenly over its cell, those without a height left out:
/// along rows and along columns each as dense as those of the finest layer, at most 8. Where the
/// raster is as fine as that, H at the post. The same for any number of threads. Errors: those of
/// reading; cancelled.
Result<LatticeHeights> lattice_heights(const Surface&, const RasterLattice&, const LatticeOptions&,
                                       const Progress& = {});

/// Would that read more than about so many posts? By where the layers lie, without reading any. Of
/// a surface that has no more posts: never.
bool takes_more_posts(const Surface&, const RasterLattice&, double posts,
                      const std::stop_token& = {});

}  // namespace tind
