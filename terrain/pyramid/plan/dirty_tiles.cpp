// By footprint: the window of posts that a tile reads, in blocks, against the blocks that changed.

#include "terrain/pyramid/plan/dirty_tiles.h"

#include <algorithm>
#include <cmath>

#include "terrain/pyramid/plan/plan_source.h"
#include "terrain/surface/tile_posts.h"
#include "terrain/surface/void_fill.h"

namespace tind {

namespace {

constexpr int kFillReach = VoidFill::kReach + 2;
constexpr int kNormalCells = 512;  // a side of the coarsest lattice that normals are taken from

std::int64_t floor_div(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0); }

/// Marks of blocks, and how many there are in a rectangle of them, at once.
class BlockCounts {
 public:
  BlockCounts(const std::vector<std::uint8_t>& marks, const SourceBlocks& blocks,
              const DemInfo& info)
      : info_(info), side_(blocks.side()), across_(blocks.across()), down_(blocks.down()) {
    sums_.resize(std::size_t((across_ + 1) * (down_ + 1)));
    for (std::int64_t j = 0; j < down_; ++j)
      for (std::int64_t i = 0; i < across_; ++i)
        at(i + 1, j + 1) =
            marks[std::size_t(j * across_ + i)] + at(i, j + 1) + at(i + 1, j) - at(i, j);
  }

  /// Is there a marked block that has posts of the window? Windows may lie outside, wholly too.
  bool any(PostWindow w) const {
    if (w.empty()) return false;
    if (!info_.wraps_longitude) return any_in(w.col, w.cols, w);
    const std::int64_t period = std::llround(info_.period_cols);
    if (w.cols >= period) return any_in(0, info_.cols, w);
    const std::int64_t col = w.col - floor_div(w.col, period) * period;
    return any_in(col, w.cols, w) || any_in(col - period, w.cols, w);
  }

 private:
  const DemInfo& info_;
  std::int64_t side_, across_, down_;
  std::vector<std::int64_t> sums_;  // of all blocks to the north-west

  std::int64_t& at(std::int64_t i, std::int64_t j) {
    return sums_[std::size_t(j * (across_ + 1) + i)];
  }
  bool any_in(std::int64_t col, std::int64_t cols, const PostWindow& w) const {
    const auto block = [&](std::int64_t post, std::int64_t end) {
      return std::clamp<std::int64_t>(floor_div(post, side_), 0, end);
    };
    if (col + cols <= 0 || w.row + w.rows <= 0 || col >= info_.cols || w.row >= info_.rows)
      return false;
    const std::int64_t i0 = block(col, across_ - 1), i1 = block(col + cols - 1, across_ - 1) + 1;
    const std::int64_t j0 = block(w.row, down_ - 1), j1 = block(w.row + w.rows - 1, down_ - 1) + 1;
    const auto sum = [&](std::int64_t i, std::int64_t j) {
      return sums_[std::size_t(j * (across_ + 1) + i)];
    };
    return sum(i1, j1) - sum(i0, j1) - sum(i1, j0) + sum(i0, j0) > 0;
  }
};

PostWindow grown(PostWindow w, std::int64_t posts) {
  w.col -= posts, w.cols += 2 * posts;
  w.row -= posts, w.rows += 2 * posts;
  return w;
}

/// Has a block changed that can say what stands beyond the source's ends near the window?
bool changed_beyond(const BlockCounts& changed, const PostWindow& posts, const DemInfo& info) {
  const PostWindow around = grown(posts, 1), reach = grown(posts, kFillReach);
  const auto strip = [&](std::int64_t col, std::int64_t row, std::int64_t cols, std::int64_t rows) {
    PostWindow w;
    w.col = std::max(col, reach.col), w.row = std::max(row, reach.row);
    w.cols = std::min(col + cols, reach.col + reach.cols) - w.col;
    w.rows = std::min(row + rows, reach.row + reach.rows) - w.row;
    return changed.any(w);
  };
  // All columns of a source that goes around the globe are inside.
  const std::int64_t first = info.wraps_longitude ? reach.col : 0;
  const std::int64_t cols = info.wraps_longitude ? reach.cols : info.cols;
  return (around.row < 0 && strip(first, 0, cols, kFillReach)) ||
         (around.row + around.rows > info.rows &&
          strip(first, info.rows - kFillReach, cols, kFillReach)) ||
         (!info.wraps_longitude && ((around.col < 0 && strip(0, 0, kFillReach, info.rows)) ||
                                    (around.col + around.cols > info.cols &&
                                     strip(info.cols - kFillReach, 0, kFillReach, info.rows))));
}

/// Blocks with voids, before or after, that a block which changed can fill.
std::vector<std::uint8_t> voids_to_fill_anew(const BlockCounts& changed, const SourceBlocks& before,
                                             const SourceBlocks& after) {
  std::vector<std::uint8_t> marks(after.size());
  const std::int64_t side = after.side();
  for (std::int64_t j = 0; j < after.down(); ++j)
    for (std::int64_t i = 0; i < after.across(); ++i) {
      if (!before.has_void(i, j) && !after.has_void(i, j)) continue;
      const PostWindow block{.col = i * side, .row = j * side, .cols = side, .rows = side};
      marks[std::size_t(j * after.across() + i)] = changed.any(grown(block, kFillReach));
    }
  return marks;
}

/// The posts near a rectangle that no post is in, so many at least.
PostWindow window_beside(const DemSource& source, GeoRect rect, std::int64_t posts) {
  const DemInfo& info = source.info();
  const double south = std::max(std::abs(rect.south), std::abs(rect.north));
  const double shrunk = std::max(0.01, std::cos(std::min(south, 89.0) * 0.017453292519943295));
  const double reach = double(std::max<std::int64_t>(2 * kFillReach, posts)) *
                       std::max(info.spacing_x_m, info.spacing_y_m) / 111320;
  rect.west -= reach / shrunk, rect.east += reach / shrunk;
  rect.south -= reach, rect.north += reach;
  return post_window(source, rect);
}

/// Marks the tiles that depend on blocks of one DEM that changed; `farther`: posts more around a
/// tile that it depends on, with all that fills voids there.
void mark(const Surface& surface, const DemSource& source, const TilePlan& plan,
          const TileOrder& ids, const SourceBlocks& before, const SourceBlocks& after,
          double farther, std::vector<std::uint8_t>& dirty) {
  const DemInfo& info = source.info();
  const BlockCounts changed(after.difference(before), after, info);
  const BlockCounts filled(voids_to_fill_anew(changed, before, after), after, info);

  const int deepest_indexed = deepest_indexed_level(surface, plan);
  for (std::size_t k = 0; k < ids.size(); ++k) {
    const TileId id = ids[k];
    const GeoRect rect = tiling::rect(id);
    const PostWindow posts = post_window(source, rect);
    const bool indexed = id.level <= deepest_indexed;
    // Normals from the index need the nodes around, and what fills voids there.
    const double degrees = plan.level(id.level).normal_reach_deg +
                           (indexed ? tiling::tile_degrees(id.level) / kNormalCells : 0);
    const double reach = degrees * 111320 / std::min(info.spacing_x_m, info.spacing_y_m) +
                         (indexed ? kFillReach : 0) + farther;
    const std::int64_t around = 2 + std::int64_t(std::ceil(reach));
    if (posts.empty()) {
      dirty[k] |= changed.any(window_beside(source, rect, around));
      continue;
    }
    const bool wide = indexed || farther > 0;
    const PostWindow near = grown(posts, around), &filled_in = wide ? near : posts;
    dirty[k] |=
        changed.any(near) || filled.any(filled_in) || changed_beyond(changed, filled_in, info);
  }
}

}  // namespace

std::vector<std::uint8_t> dirty_tiles(const Surface& surface, const TilePlan& plan,
                                      const TileOrder& ids, const SurfaceBlocks& before,
                                      const SurfaceBlocks& after) {
  std::vector<std::uint8_t> dirty(ids.size());
  double bent_m = 0;  // a chain of layers, each bent to the next
  for (const SurfaceLayer& layer : surface.layers()) bent_m += layer.blend_m;
  for (std::size_t k = 0; k < surface.layers().size(); ++k) {
    const DemSource& source = *surface.layers()[k].source;
    const DemInfo& info = source.info();
    // Where layers end, what fills voids of one is bent to another.
    const double farther =
        surface.only() ? 0 : bent_m / std::min(info.spacing_x_m, info.spacing_y_m) + kFillReach;
    mark(surface, source, plan, ids, before.layers()[k], after.layers()[k], farther, dirty);
  }
  return dirty;
}

}  // namespace tind
