#pragma once
// What is decided before the first tile is made: levels, error budgets, height steps, availability.
// A pure function of the source's facts and the options.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/geo/availability.h"
#include "terrain/geo/tile_order.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/pyramid/residual/index_depth.h"
#include "terrain/raster/dem_source.h"
#include "terrain/surface/surface.h"
#include "terrain/tile/border.h"

namespace tind {

class ResidualIndex;
class SourceBlocks;
class TilePlan;

struct PostPlace {
  std::int64_t col = 0, row = 0;
  std::size_t layer = 0;
};

/// The lowest and highest valid post of a source.
struct HeightRange {
  double min_m = 0, max_m = 0;
  std::uint64_t valid = 0;  // posts
  /// Where, if a pass over the posts has met them; of several the same for any number of threads.
  std::optional<PostPlace> lowest = {}, highest = {};
  /// By level, of the posts in and around its tiles, where that is less than all (layers).
  std::vector<std::pair<double, double>> of_levels = {};

  /// Takes in posts. REQUIRES: a range that began as {HUGE_VAL, -HUGE_VAL, 0}.
  void add(std::span<const float> posts);
};

class SurfaceBlocks;
class StepMemo;

/// One streaming pass over all posts, 4 MB a thread. Fails where a block is unreadable. `blocks`:
/// learn what the posts are in the same pass.
Result<HeightRange> read_height_range(const DemSource&, const Progress& = {}, int threads = 0,
                                      SourceBlocks* blocks = nullptr);
/// Of several layers: what the levels below the end of the coarsest one need to know of the range
/// (HeightRange::of_levels). Reads posts of the coarser layers under the finer ones. `outline`: a
/// plan of the same levels.
Result<void> find_level_ranges(const Surface&, const TilePlan& outline, HeightRange&);
/// Why there is nothing to be made of a source without a valid post.
std::string no_valid_height(const DemInfo&);
/// The same, and fails with bad_data where no post is valid.
Result<HeightRange> scan_heights(const Surface&, const Progress& = {}, int threads = 0,
                                 SurfaceBlocks* blocks = nullptr);

/// A tile of this level keeps the vertices of a lattice of so many cells a side, so that its
/// triangles, drawn straight through space, follow the earth's curvature. A power of two.
int curvature_cells(int level);

/// Vertices stand on multiples of this many units of the tile's grid: few different numbers take
/// few bytes once tiles are compressed, and within an error bound the exact place is worth
/// little. A power of two: at most a quarter of the way between every step-th post, and no more
/// than the bound.
int place_step(double spacing_m, int level, double eps);

struct LevelPlan {
  double budget_m = 0;     // no post of a tile may be farther than this from its mesh
  double fit_error_m = 0;  // half width of the band that the mesh is fitted into: the budget, or
                           // less where it is huge; half of that for one-sided tiles
  double offset_m = 0;     // of the band's middle from the posts: 0, or +- fit_error_m (one-sided)
  double border_tolerance_m = 0;
  int border_samples = 256;  // along an edge, where the source's posts do not say (power of two)
  /// Heights on tile borders are multiples of this power of two. Of one DEM without lines: of the
  /// level's usual one, where the heights near a tile need none that is coarser (height_steps.h).
  double border_step_m = 0;
  int border_place_step = 1;    // and their places multiples of this, of 32767 along the side
  int curvature_cells = 1;      // see above
  double line_tolerance = 1;    // units of the tile's grid by which lines may be thinned
  double normal_reach_deg = 0;  // normals are taken from H's differences over +- this
  /// No height of a surface of layers is beyond these: what bends a layer overshoots its posts by
  /// as much as two layers differ at most.
  double lowest_m = -HUGE_VAL, highest_m = HUGE_VAL;

  friend bool operator==(const LevelPlan&, const LevelPlan&) = default;
};

class TilePlan {
 public:
  /// Fails with `unsupported` for a DEM without CRS, `invalid_argument` for bad options, and as
  /// check_heights() does.
  static Result<TilePlan> make(const Surface&, const HeightRange&, const TileSetOptions&);

  /// Where the pyramid ends: its tiles keep the final bound. Tiles are made for a pyramid of all
  /// levels from 0 on, whichever of them are asked for.
  int max_level() const { return max_level_; }
  /// The levels that are asked for.
  int first_level() const { return first_level_; }
  int last_level() const { return last_level_; }
  /// Of a level's tiles that have tiles below them in all of their parts with posts; of the last
  /// level, of its strictest tiles. Of one DEM all tiles of a level are alike.
  const LevelPlan& level(int z) const {
    const auto& kinds = levels_[std::size_t(z)];
    return z == max_level_ ? kinds[1] : kinds.front();
  }
  /// Of a tile. Where a part of it has posts, but no tile below it, it is as exact as the strictest
  /// layer that has posts there asks for.
  const LevelPlan& level(TileId t) const { return levels_[std::size_t(t.level)][kind_of(t)]; }
  /// Of a side of it: of the stricter of the two tiles that share it; where tiles go on below on
  /// one side only, as strict as those.
  const LevelPlan& level(TileId, TileSide) const;
  /// The deepest level with tiles of which layer k is the reason.
  int deepest_of(std::size_t k) const { return leaves_[k]; }
  const TileSetOptions& options() const { return options_; }
  const HeightRange& range() const { return range_; }
  bool knows_range() const { return range_.valid > 0; }

  /// Do the steps of heights go by what lies near a tile, rather than by all heights?
  bool local_steps() const { return local_steps_; }
  /// Of a tile with so many posts, or one at a pole, which all tiles around it share, even then by
  /// all heights. The step of such tiles.
  bool has_step_of_all(TileId) const;
  double step_of_all(int level) const;
  /// Can a tile be made only when all heights are known? So it is with those, those beside one at a
  /// pole, and with all where steps go by all heights.
  bool rests_on_all_heights(TileId) const;
  /// Copies of a plan share it.
  StepMemo& step_memo() const { return *memo_; }
  /// Stand for the surface's lines and water, and for their levels; empty where it has none.
  const std::string& shapes() const { return shapes_; }
  const std::string& levels_of_shapes() const { return levels_of_shapes_; }

  /// Which tiles rest on the residual index: their borders, and those of all tiles down to its
  /// level, leave room for what it does not know. None of one-sided tiles, of which every post is
  /// read: the index does not tell above from below; nor where no level asked for has any.
  const IndexDepth& index_depth() const { return depth_; }
  /// From here on these tiles are fitted and certified through the index. REQUIRES: one of this
  /// depth.
  void use(std::shared_ptr<const ResidualIndex> index) { index_ = std::move(index); }
  /// Null where there is none.
  const ResidualIndex* index() const { return index_.get(); }

  /// Tiles of a level that touch an extent of the source: where no file is, there are none. Level 0
  /// always has both roots. What is void in a file has tiles: which posts are, only reading says.
  const TileArea& tiles(int level) const { return areas_[std::size_t(level)]; }
  bool available(TileId) const;
  /// Numbers for the tiles of the levels asked for. The plan must outlive it.
  TileOrder order() const { return {areas_, first_level_, last_level_}; }
  /// The same of the levels asked for: a tile, how many, and what says so to others.
  bool wanted(TileId) const;
  std::uint64_t tile_count() const;
  proto::LayerJson layer(const std::string& name) const;
  /// What whoever asked for it may not have meant: very many tiles for so few posts, or files that
  /// lie far apart. One line; mostly empty.
  std::string warning(const Surface&) const;

  /// What the metadata of a tile of every kAvailabilityLevels-th level lists: by level from the
  /// next one on, the tiles of the whole pyramid below it. Empty for tiles of other levels.
  static constexpr int kAvailabilityLevels = 10;
  std::vector<std::vector<proto::TileRange>> descendants(TileId) const;

 private:
  std::size_t kind_of(TileId) const;
  std::size_t kind_below(TileId, TileSide) const;
  void settle_ends(const Surface&);
  void settle_areas(const Surface&);
  void leave_room();
  Vec2 spacing_at(const Surface&, int level) const;
  std::vector<LevelPlan> kinds_of(const Surface&, int level) const;

  int max_level_ = 0, first_level_ = 0, last_level_ = 0;
  /// By level: [0] of tiles that go on below, [i] of those that end, by ends_m_[i - 1].
  std::vector<std::vector<LevelPlan>> levels_;
  std::vector<double> ends_m_;                      // of layers at their ends, the strictest first
  std::vector<int> leaves_;                         // by layer
  std::vector<std::size_t> bound_of_;               // by layer, in ends_m_
  std::vector<std::vector<TileArea>> layer_areas_;  // by layer and level; of several layers
  TileSetOptions options_;
  HeightRange range_;
  std::string shapes_, levels_of_shapes_;
  bool water_mask_ = false;
  GeoRect bounds_;
  VerticalDatum datum_ = VerticalDatum::unknown;
  std::vector<proto::StatedAccuracy> accuracy_;
  std::vector<TileArea> areas_;  // by level from 0
  IndexDepth depth_ = -1;
  int most_posts_level_ = -1;  // the deepest whose tiles have very many posts
  bool local_steps_ = false;
  std::shared_ptr<StepMemo> memo_;
  std::shared_ptr<const ResidualIndex> index_;
};

}  // namespace tind
