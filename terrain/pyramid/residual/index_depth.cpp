#include "terrain/pyramid/residual/index_depth.h"

#include <algorithm>
#include <cmath>

#include "terrain/base/power_of_two.h"
#include "terrain/geo/ellipsoid.h"

namespace tind {

namespace {

constexpr double kStepOfLayers_m = 1.0 / 64;
/// No finer than a record can hold heights of the earth in: 2^24 steps.
constexpr double kLeastStepOfDem_m = 1.0 / 1024;

/// Of a DEM, in a tile that lies on it.
double posts_of_tile(const DemInfo& info, int level) {
  const double lat = std::clamp((info.bounds.south + info.bounds.north) / 2, -80.0, 80.0);
  const Vec2 degree = wgs84::metres_per_degree(lat);
  const double side = tiling::tile_degrees(level);
  const double cols = std::min(double(info.cols), side * degree.x / info.spacing_x_m);
  const double rows = std::min(double(info.rows), side * degree.y / info.spacing_y_m);
  return cols * rows;
}

int deepest_over(const DemInfo& info, double most) {
  for (int z = tiling::kMaxLevel; z >= 0; --z)
    if (posts_of_tile(info, z) > most) return z;
  return -1;
}

/// Of all layers that can have a say in a tile.
double posts_of_tile(const Surface& surface, TileId id) {
  double posts = 0;
  for (std::size_t k = 0; k < surface.layers().size(); ++k)
    if (surface.reaches(k, tiling::rect(id)))
      posts += posts_of_tile(surface.layers()[k].source->info(), id.level);
  return posts;
}

}  // namespace

int deepest_indexed_level(const DemInfo& info, std::int64_t exact_posts) {
  if (info.crs_kind == CrsKind::none) return -1;
  if (exact_posts <= 0 && info.cols <= kExactSourcePosts / std::max<std::int64_t>(1, info.rows))
    return -1;
  return deepest_over(info, double(exact_posts > 0 ? exact_posts : kExactTilePosts));
}

int deepest_indexed_level(const Surface& surface, std::int64_t exact_posts) {
  if (const DemSource* dem = surface.only()) return deepest_indexed_level(dem->info(), exact_posts);
  return std::max(-1, IndexDepth::of(surface, exact_posts).level() - 1);
}

IndexDepth IndexDepth::of(const Surface& surface, std::int64_t exact_posts) {
  if (const DemSource* dem = surface.only()) {
    const int deepest = deepest_indexed_level(dem->info(), exact_posts);
    return deepest < 0 ? -1 : deepest + 1;
  }
  IndexDepth depth(-1);
  depth.most_posts_ = exact_posts > 0 ? exact_posts : kExactTilePosts;
  if (exact_posts <= 0 && surface.post_count() <= kExactSourcePosts) return depth;
  // Posts of a tile are never more than those of its parent: from the roots down as far as needed.
  std::vector<TileId> level;
  level.reserve(tiling::columns(0));
  for (std::uint32_t x = 0; x < tiling::columns(0); ++x) level.push_back({0, x, 0});
  while (!level.empty() && level.front().level < tiling::kMaxLevel) {
    std::erase_if(
        level, [&](TileId id) { return posts_of_tile(surface, id) <= double(depth.most_posts_); });
    depth.tiles_.insert(depth.tiles_.end(), level.begin(), level.end());
    std::vector<TileId> next;
    for (const TileId id : level)
      for (int part = 0; part < 4; ++part) next.push_back(id.child(part % 2, part / 2));
    level = std::move(next);
  }
  std::ranges::sort(depth.tiles_);
  if (depth.tiles_.empty()) return depth;
  depth.level_ = depth.coarsest_ = depth.tiles_.back().level + 1;
  for (const SurfaceLayer& layer : surface.layers())
    if (const int z = deepest_over(layer.source->info(), double(depth.most_posts_)); z >= 0)
      depth.coarsest_ = std::min(depth.coarsest_, z + 1);
  return depth;
}

bool IndexDepth::serves(TileId id) const {
  return most_posts_ > 0 ? std::ranges::binary_search(tiles_, id) : id.level < level_;
}

bool IndexDepth::has_least_step() const {
  return tiling::level_error(level_) / 1024 < kLeastStepOfDem_m;
}

double IndexDepth::step_m() const {
  if (most_posts_ > 0) return kStepOfLayers_m;
  return has_least_step() ? kLeastStepOfDem_m
                          : power_of_two_at_most(tiling::level_error(level_) / 1024);
}

}  // namespace tind
