#pragma once
// Which tiles rest on the residual index, and so which records it has: a function of what a source
// says of itself, so that a plan, a build, a daemon and an update agree without looking at a post.

#include <cstdint>
#include <span>
#include <vector>

#include "terrain/geo/tiling_scheme.h"
#include "terrain/raster/dem_source.h"
#include "terrain/surface/surface.h"

namespace tind {

/// Tiles of so many posts are certified post by post; of a source with no more than the second
/// number, all are.
inline constexpr std::int64_t kExactTilePosts = 2'500'000;
inline constexpr std::int64_t kExactSourcePosts = std::int64_t(1) << 25;

/// The deepest level whose tiles rest on the index, -1 when none does. `exact_posts` > 0: instead
/// of both numbers above.
int deepest_indexed_level(const DemInfo&, std::int64_t exact_posts = 0);
int deepest_indexed_level(const Surface&, std::int64_t exact_posts = 0);

/// A tile that rests on the index has records of its four parts: its residuals at its own level
/// would take too much of its budget. Of one DEM all tiles down to a level do. Of layers those with
/// too many posts of all layers together: under a town of fine posts the index goes as deep as they
/// ask for, beside it no deeper than the posts that are there.
class IndexDepth {
 public:
  /// Records of all tiles down to a level; -1: none.
  IndexDepth(int level) : level_(level), coarsest_(level) {}  // NOLINT: a level is a depth
  static IndexDepth of(const Surface&, std::int64_t exact_posts = 0);

  /// The deepest that there are records of; -1: no tile rests on the index.
  int level() const { return level_; }
  /// The same, as the coarsest layer that needs an index would have it alone.
  int coarsest_level() const { return coarsest_; }
  bool serves(TileId) const;

  /// Of layers: the tiles that rest on the index, by level and number. Empty of one DEM.
  std::span<const TileId> tiles() const { return tiles_; }
  /// Of layers: tiles of more posts than this rest on the index; of one DEM 0.
  std::int64_t most_posts() const { return most_posts_; }

  /// Heights of nodes are multiples of this power of two: of one DEM a thousandth of the deepest
  /// level's error; of layers one number, so that a finer layer changes no record far from it.
  double step_m() const;
  /// Of one DEM: so deep that its step is the least that there is, not that thousandth.
  bool has_least_step() const;

 private:
  int level_, coarsest_;
  std::int64_t most_posts_ = 0;
  std::vector<TileId> tiles_;  // sorted
};

}  // namespace tind
