#pragma once
// A DEM of any number of posts in longitudes and latitudes: they are made up as they are read.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>

#include "terrain/base/result.h"
#include "terrain/geo/longitude.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"

namespace tind::test {

class VastSource : public DemSource {
 public:
  /// Goes around the globe where it has as many columns as that takes. REQUIRES: it begins in the
  /// first turn.
  VastSource(std::int64_t cols, std::int64_t rows, Geographic north_west, double spacing_deg) {
    info_.post_to_crs = {north_west.lon, spacing_deg, 0, north_west.lat, 0, -spacing_deg};
    info_.files = {"vast"};
    info_.cols = cols, info_.rows = rows;
    info_.has_geotransform = true;
    info_.crs_kind = CrsKind::geographic;
    info_.period_cols = std::round(360 / spacing_deg);
    info_.wraps_longitude = double(cols) == info_.period_cols;
    info_.fingerprint = "0123456789abcdef0123456789abcdef";
    info_.bounds = {north_west.lon, north_west.lat - double(rows - 1) * spacing_deg,
                    north_west.lon + double(cols - 1) * spacing_deg, north_west.lat};
    if (info_.wraps_longitude || info_.bounds.east > 180)
      info_.bounds.west = -180, info_.bounds.east = 180;
    info_.spacing_x_m = spacing_deg * 111320 * std::cos(north_west.lat * 0.01745329);
    info_.spacing_y_m = spacing_deg * 111320;
  }

  const DemInfo& info() const override { return info_; }
  Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const override {
    return read_decimated(col, row, cols, rows, 1);
  }
  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int step) const override {
    ++reads;
    for (std::int64_t now = std::int64_t(cols) * rows, was = largest_read.load();
         now > was && !largest_read.compare_exchange_weak(was, now);) {
    }
    HeightGrid out(cols, rows);
    for (int j = 0; j < rows; ++j) {
      const std::int64_t r = row + std::int64_t(j) * step;
      if (r < 0 || r >= info_.rows) continue;
      for (int i = 0; i < cols; ++i) {
        std::int64_t c = col + std::int64_t(i) * step;
        if (info_.wraps_longitude) c = (c % info_.cols + info_.cols) % info_.cols;
        if (c >= 0 && c < info_.cols) out.at(i, j) = float((c * 73 + r * 151) & 4095) / 4;
      }
    }
    return out;
  }
  void to_post(std::span<const Geographic> in, std::span<Vec2> out) const override {
    const double middle = info_.post_to_crs.apply(double(info_.cols - 1) / 2, 0).x;
    for (std::size_t i = 0; i < in.size(); ++i) {
      out[i] = info_.post_to_crs.invert(nearest_turn(in[i].lon, middle, 360), in[i].lat);
      if (info_.wraps_longitude && out[i].x < 0) out[i].x += info_.period_cols;
    }
  }
  void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const override {
    for (std::size_t i = 0; i < in.size(); ++i) {
      const Vec2 p = info_.post_to_crs.apply(in[i].x, in[i].y);
      out[i] = within_first_turn({p.x, p.y});
    }
  }
  bool is_plain_geographic() const override { return true; }

  mutable std::atomic<std::int64_t> reads = 0, largest_read = 0;  // the largest in posts

 private:
  DemInfo info_;
};

}  // namespace tind::test
