// With an index: down from the roots, at each level into the first tile that has the height in its
// range, and there from post to post.

#include "terrain/pyramid/plan/height_extremes.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "terrain/pyramid/residual/residual_index.h"
#include "terrain/surface/tile_posts.h"

namespace tind {

namespace {

enum class End { lowest, highest };

/// Does the tile hold a post of this height? Fails where the index is damaged.
Result<bool> holds(const ResidualIndex& index, TileId id, End end, double height_m) {
  const auto record = index.head(id);
  if (!record) {
    if (record.error().code == Errc::not_found) return false;  // the source does not touch it
    return std::unexpected(record.error());
  }
  const ResidualFacts& r = **record;
  return r.has_posts() && (end == End::lowest ? r.min_m : r.max_m) == height_m;
}

/// The first of these tiles that does.
Result<TileId> first_holder(const ResidualIndex& index, const std::vector<TileId>& tiles, End end,
                            double height_m) {
  for (const TileId id : tiles) {
    const auto found = holds(index, id, end, height_m);
    if (!found) return std::unexpected(found.error());
    if (*found) return id;
  }
  return fail(Errc::internal, "the residual index has a range that none of its tiles has");
}

Result<TileId> deepest_holder(const ResidualIndex& index, End end, double height_m) {
  std::vector<TileId> tiles;
  tiles.reserve(tiling::columns(0));
  for (std::uint32_t x = 0; x < tiling::columns(0); ++x) tiles.push_back({0, x, 0});
  auto found = first_holder(index, tiles, end, height_m);
  while (found && found->level < index.level()) {
    tiles.clear();
    for (int k = 0; k < 4; ++k) tiles.push_back(found->child(k % 2, k / 2));
    found = first_holder(index, tiles, end, height_m);
  }
  return found;
}

/// The first post of this height in the rectangle, in strips so that a wide one takes no memory.
Result<PostPlace> find_post(const DemSource& source, const GeoRect& rect, double height_m,
                            const std::stop_token& stop) {
  constexpr std::int64_t kRows = 64;
  for (const PostWindow& window : post_windows(source, rect))
    for (std::int64_t row = 0; row < window.rows; row += kRows) {
      if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
      const auto grid = source.read(window.col, window.row + row, int(window.cols),
                                    int(std::min(kRows, window.rows - row)));
      if (!grid) return std::unexpected(grid.error());
      const auto values = grid->values();
      const auto at = std::ranges::find(values, float(height_m)) - values.begin();
      if (std::size_t(at) < values.size())
        return PostPlace{window.col + at % grid->cols(), window.row + row + at / grid->cols()};
    }
  return fail(Errc::bad_data, "a post that the residual index was made from is not there any more");
}

Result<PostPlace> place_of(const DemSource& source, const TilePlan& plan, End end,
                           const std::stop_token& stop) {
  const HeightRange& range = plan.range();
  const auto& met = end == End::lowest ? range.lowest : range.highest;
  if (met) return *met;
  const double height_m = end == End::lowest ? range.min_m : range.max_m;
  const auto tile = deepest_holder(*plan.index(), end, height_m);
  if (!tile) return std::unexpected(tile.error());
  return find_post(source, tiling::rect(*tile), height_m, stop);
}

}  // namespace

Result<HeightExtremes> find_extremes(const Surface& surface, const TilePlan& plan,
                                     std::stop_token stop) {
  const DemSource& source = *surface.layers().front().source;
  const auto lowest = place_of(source, plan, End::lowest, stop);
  if (!lowest) return std::unexpected(lowest.error());
  const auto highest = place_of(source, plan, End::highest, stop);
  if (!highest) return std::unexpected(highest.error());
  std::vector<Geographic> where(2);
  for (std::size_t i = 0; i < 2; ++i) {
    const PostPlace& place = i == 0 ? *lowest : *highest;
    const Vec2 post{double(place.col), double(place.row)};
    surface.layers()[place.layer].source->to_geographic({&post, 1}, {&where[i], 1});
  }
  return HeightExtremes{{where[0], plan.range().min_m}, {where[1], plan.range().max_m}};
}

}  // namespace tind
