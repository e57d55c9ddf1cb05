#include "terrain/analysis/level_dem.h"

#include <utility>
#include <vector>

#include "terrain/encode/quantized_mesh_tile.h"

namespace tind {
namespace {

/// Half of the last bit of a float below 16384 m: heights are kept as such.
constexpr double kRounding_m = 1.0 / 2048;

}  // namespace

LevelTiles level_tiles_of(const TileSet& tiles) {
  return {[&tiles](TileId id) { return tiles.available(id); },
          [&tiles](TileId id, const std::stop_token& stop) -> Result<TileModel> {
            const auto tile = tiles.tile(id, stop);
            if (!tile) return std::unexpected(tile.error());
            return decode_tile(id, tile->bytes);
          }};
}

LevelDem::LevelDem(std::shared_ptr<const DemSource> grid, LevelTiles tiles, int level,
                   VerticalDatum datum)
    : grid_(std::move(grid)), tiles_(std::move(tiles)), level_(level), info_(grid_->info()) {
  info_.datum = std::move(datum);
}

Result<HeightGrid> LevelDem::read(std::int64_t col, std::int64_t row, int cols, int rows) const {
  auto posts = grid_->read(col, row, cols, rows);
  return posts ? seen(std::move(*posts), col, row, 1) : posts;
}

Result<HeightGrid> LevelDem::read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                            int step) const {
  auto posts = grid_->read_decimated(col, row, cols, rows, step);
  return posts ? seen(std::move(*posts), col, row, step) : posts;
}

void LevelDem::to_post(std::span<const Geographic> in, std::span<Vec2> out) const {
  grid_->to_post(in, out);
}

void LevelDem::to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const {
  grid_->to_geographic(in, out);
}

Result<HeightGrid> LevelDem::seen(HeightGrid posts, std::int64_t col, std::int64_t row,
                                  int step) const {
  std::vector<Vec2> at;
  for (int r = 0; r < posts.rows(); ++r)
    for (int c = 0; c < posts.cols(); ++c)
      if (!posts.is_void(c, r))
        at.push_back({double(col + std::int64_t(c) * step), double(row + std::int64_t(r) * step)});
  std::vector<Geographic> places(at.size());
  grid_->to_geographic(at, places);
  const auto heights = level_heights(tiles_, places, level_);
  if (!heights) return std::unexpected(heights.error());
  std::size_t n = 0;
  double worst = max_error_m_;
  for (float& z : posts.values()) {
    if (std::isnan(z)) continue;
    const auto& height = (*heights)[n++];
    z = height ? float(height->height_m) : HeightGrid::kVoid;
    if (!height) continue;
    if (!height->max_error_m)
      return fail(Errc::bad_data, "tile " + height->tile.text() +
                                      " states no error, so nothing is certain of what is seen");
    worst = std::max(worst, *height->max_error_m + kRounding_m);
  }
  for (double now = max_error_m_; now < worst;)
    if (max_error_m_.compare_exchange_weak(now, worst)) break;
  return posts;
}

}  // namespace tind
