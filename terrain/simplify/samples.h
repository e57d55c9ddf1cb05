#pragma once
// What a bounded mesh is measured against: sets of samples that can be scanned by triangle.
//
// Both kinds offer
//     bool scan(a, b, c, f)   calls f(x, y, z, index) for every valid sample in the closed triangle
//                             abc (counter-clockwise; a hair beyond its edges, so that no sample
//                             on a shared edge is lost to rounding) until f returns false;
//                             false when f stopped it
//     Vec3 sample(index)
// Coordinates are those of the mesh: x to the right, y up. Heights are float in memory, double in
// every computation; `offset` is added to each (one-sided bounds shift the band that way).

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "terrain/geo/coordinates.h"
#include "terrain/mesh/tin.h"

namespace tind {

/// Samples on an axis-aligned grid: x = x0 + col * dx, y = y0 - row * dy.
struct GridSamples {
  int cols = 0, rows = 0;
  double x0 = 0, y0 = 0, dx = 1, dy = 1;  // dx, dy > 0
  const float* z = nullptr;               // rows of `stride` floats, NaN = void
  std::size_t stride = 0;                 // 0: cols
  double offset = 0;

  std::size_t size() const { return std::size_t(cols) * rows; }
  std::size_t row_length() const { return stride ? stride : std::size_t(cols); }
  Vec3 sample(std::size_t i) const {
    const std::size_t n = row_length();
    return {x0 + double(i % n) * dx, y0 - double(i / n) * dy, double(z[i]) + offset};
  }

  template <class F>
  bool scan(const Vec3& a, const Vec3& b, const Vec3& c, F&& f) const {
    constexpr double kHair = 1e-7;  // of a sample step
    const Vec3 *top = &a, *mid = &b, *low = &c;
    if (top->y < mid->y) std::swap(top, mid);
    if (mid->y < low->y) std::swap(mid, low);
    if (top->y < mid->y) std::swap(top, mid);
    // Row coordinates grow downwards.
    const double top_row = (y0 - top->y) / dy, mid_row = (y0 - mid->y) / dy;
    const double low_row = (y0 - low->y) / dy;
    const int first = int(std::max(0.0, std::ceil(top_row - kHair)));
    const int last = int(std::min(double(rows - 1), std::floor(low_row + kHair)));
    if (first > last) return true;
    const double top_col = (top->x - x0) / dx, mid_col = (mid->x - x0) / dx;
    const double low_col = (low->x - x0) / dx;
    const double long_slope = low_row > top_row ? (low_col - top_col) / (low_row - top_row) : 0;
    const double up_slope = mid_row > top_row ? (mid_col - top_col) / (mid_row - top_row) : 0;
    const double down_slope = low_row > mid_row ? (low_col - mid_col) / (low_row - mid_row) : 0;
    for (int row = first; row <= last; ++row) {
      const double r = std::clamp(double(row), top_row, low_row);
      double left, right;
      if (low_row > top_row) {
        left = top_col + (r - top_row) * long_slope;
        right = r < mid_row ? top_col + (r - top_row) * up_slope
                            : (low_row > mid_row ? mid_col + (r - mid_row) * down_slope : mid_col);
      } else {  // all on one row
        left = std::min({top_col, mid_col, low_col});
        right = std::max({top_col, mid_col, low_col});
      }
      if (left > right) std::swap(left, right);
      const int i0 = int(std::max(0.0, std::ceil(left - kHair)));
      const int i1 = int(std::min(double(cols - 1), std::floor(right + kHair)));
      const double y = y0 - double(row) * dy;
      const std::size_t base = std::size_t(row) * row_length();
      for (int i = i0; i <= i1; ++i) {
        const double h = z[base + i];
        if (std::isnan(h)) continue;
        if (!f(x0 + double(i) * dx, y, h + offset, base + std::size_t(i))) return false;
      }
    }
    return true;
  }
};

/// Samples anywhere, in buckets of a uniform grid over [0, extent]^2.
class ScatteredSamples {
 public:
  double offset = 0;

  ScatteredSamples() = default;
  /// Copies the valid (non-NaN) points; about `per_bucket` of them share a bucket.
  ScatteredSamples(std::span<const Vec3> points, double extent, double per_bucket = 2);

  std::size_t size() const { return points_.size(); }
  Vec3 sample(std::size_t i) const { return {points_[i].x, points_[i].y, points_[i].z + offset}; }

  template <class F>
  bool scan(const Vec3& a, const Vec3& b, const Vec3& c, F&& f) const {
    const double hair = 1e-7;
    const double min_x = std::min({a.x, b.x, c.x}) - hair, max_x = std::max({a.x, b.x, c.x}) + hair;
    const double min_y = std::min({a.y, b.y, c.y}) - hair, max_y = std::max({a.y, b.y, c.y}) + hair;
    // A point is inside when it lies left of each edge, a hair allowed.
    const double ab = hair * std::hypot(b.x - a.x, b.y - a.y);
    const double bc = hair * std::hypot(c.x - b.x, c.y - b.y);
    const double ca = hair * std::hypot(a.x - c.x, a.y - c.y);
    for (int row = bucket(min_y); row <= bucket(max_y); ++row) {
      const std::size_t base = std::size_t(row) * side_;
      const std::uint32_t first = start_[base + bucket(min_x)];
      const std::uint32_t last = start_[base + bucket(max_x) + 1];
      for (std::uint32_t i = first; i < last; ++i) {
        const Vec3& p = points_[i];
        if (p.x < min_x || p.x > max_x || p.y < min_y || p.y > max_y) continue;
        if (orient2d(a, b, p) < -ab || orient2d(b, c, p) < -bc || orient2d(c, a, p) < -ca) continue;
        if (!f(p.x, p.y, p.z + offset, std::size_t(i))) return false;
      }
    }
    return true;
  }

 private:
  int side_ = 1;
  double scale_ = 0;
  std::vector<Vec3> points_;
  std::vector<std::uint32_t> start_ = {0, 0};

  int bucket(double t) const { return std::clamp(int(t * scale_), 0, side_ - 1); }
};

}  // namespace tind
