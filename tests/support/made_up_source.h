#pragma once
// A DEM out of numbers: posts on any affine grid in degrees, turned or not.

#include <atomic>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"
#include "tests/support/support.h"

namespace tind::test {

class MadeUpSource : public DemSource {
 public:
  /// `turn` (radians) makes it one whose posts are not on lines of longitude and latitude.
  MadeUpSource(HeightGrid grid, Geographic north_west, double spacing_deg, double turn = 0,
               std::string fingerprint = "0123456789abcdef0123456789abcdef")
      : grid_(std::move(grid)), plain_(turn == 0) {
    const double c = spacing_deg * std::cos(turn), s = spacing_deg * std::sin(turn);
    info_.post_to_crs = {north_west.lon, c, s, north_west.lat, s, -c};
    info_.files = {"made-up"};
    info_.cols = grid_.cols(), info_.rows = grid_.rows();
    info_.has_geotransform = true;
    info_.crs_kind = CrsKind::geographic;
    info_.period_cols = 360 / spacing_deg;
    info_.fingerprint = std::move(fingerprint);
    GeoRect& b = info_.bounds;
    b = {HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (const double col : {0.0, double(grid_.cols() - 1)})
      for (const double row : {0.0, double(grid_.rows() - 1)}) {
        const Vec2 p = info_.post_to_crs.apply(col, row);
        b = {std::min(b.west, p.x), std::min(b.south, p.y), std::max(b.east, p.x),
             std::max(b.north, p.y)};
      }
    info_.spacing_x_m = spacing_deg * 111320 * std::cos(north_west.lat * 0.01745329);
    info_.spacing_y_m = spacing_deg * 111320;
  }

  const DemInfo& info() const override { return info_; }
  Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const override {
    return read_decimated(col, row, cols, rows, 1);
  }
  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int step) const override {
    if (--reads_left < 0) return fail(Errc::io, "the disk is gone");
    HeightGrid out(cols, rows);
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < cols; ++i) {
        const std::int64_t c = col + std::int64_t(i) * step, r = row + std::int64_t(j) * step;
        if (c >= 0 && r >= 0 && c < grid_.cols() && r < grid_.rows())
          out.at(i, j) = grid_.at(int(c), int(r));
      }
    return out;
  }
  void to_post(std::span<const Geographic> in, std::span<Vec2> out) const override {
    for (std::size_t i = 0; i < in.size(); ++i)
      out[i] = info_.post_to_crs.invert(in[i].lon, in[i].lat);
  }
  void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const override {
    for (std::size_t i = 0; i < in.size(); ++i) {
      const Vec2 p = info_.post_to_crs.apply(in[i].x, in[i].y);
      out[i] = {p.x, p.y};
    }
  }
  bool is_plain_geographic() const override { return plain_; }

  const HeightGrid& grid() const { return grid_; }
  /// Reads that succeed before all fail.
  mutable std::atomic<std::int64_t> reads_left = std::numeric_limits<std::int64_t>::max();

 private:
  HeightGrid grid_;
  DemInfo info_;
  bool plain_;
};

/// Rough terrain with voids: a corner, a stripe, and single posts.
inline HeightGrid terrain_with_voids(int cols, int rows, unsigned seed, float relief = 500) {
  HeightGrid grid = rough_terrain(cols, rows, seed, relief);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < cols; ++c)
      if (c + 2 * r < cols / 3 || (c > cols / 2 && c < cols / 2 + 4) || (c * 31 + r * 17) % 97 == 0)
        grid.at(c, r) = HeightGrid::kVoid;
  return grid;
}

}  // namespace tind::test
