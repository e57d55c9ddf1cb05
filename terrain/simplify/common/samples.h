#pragma once
// The samples that a mesh is measured against: sets of points that can be scanned by triangle.
//
// Both kinds offer
//     bool scan(a, b, c, f)   calls f(x, y, z, index) for every valid sample in the closed triangle
//                             abc (counter-clockwise; 1e-7 larger on each side, so that rounding
//                             loses no sample on a shared edge) until f returns false. Returns
//                             false if f stopped it
//     bool scan_outside(a, b, c, band, f)
//                             the same, but only for samples that may lie outside `band`, which f
//                             may narrow. Nearly all samples lie inside; these cost next to nothing
//     Vec3 sample(index)
//     static bool takes(a, b, c)
//                             may a mesh over these have triangle abc: is it counter-clockwise?
// Coordinates are those of the mesh: x to the right, y up. Heights are float in memory, double in
// every computation. `offset` is added to each: it shifts the band for a bound on one side.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "terrain/geo/coordinates.h"
#include "terrain/mesh/exact_line.h"
#include "terrain/mesh/tin.h"

namespace tind {

/// What scan_outside leaves out: the samples between two planes, both given relative to the place
/// (x, y) and the height z. Whoever decides by it measures again, exactly: it may let through
/// samples that are inside, never hold back one that is outside.
struct Band {
  double x = 0, y = 0, z = 0;
  double top = 0, top_x = 0, top_y = 0;           // height above z at (x, y), and slopes
  double bottom = 0, bottom_x = 0, bottom_y = 0;  // the same below
  double size = 0;  // largest distance of either plane from z over the triangle

  /// With one plane still unknown every sample is of interest.
  bool open() const { return !(std::isfinite(top) && std::isfinite(bottom)); }
};

/// Samples on an axis-aligned grid: x = x0 + col * dx, y = y0 - row * dy.
struct GridSamples {
  int cols = 0, rows = 0;
  double x0 = 0, y0 = 0, dx = 1, dy = 1;  // dx, dy > 0
  const float* z = nullptr;               // rows of `stride` floats, NaN = void
  std::size_t stride = 0;                 // 0: cols
  double offset = 0;

  static bool takes(const Vec3& a, const Vec3& b, const Vec3& c) { return surely_ccw(a, b, c); }

  std::size_t size() const { return std::size_t(cols) * rows; }
  std::size_t row_length() const { return stride ? stride : std::size_t(cols); }
  Vec3 sample(std::size_t i) const {
    const std::size_t n = row_length(), row = i / n, col = i % n;
    return {x0 + double(col) * dx, y0 - double(row) * dy, double(z[i]) + offset};
  }

  template <class F>
  bool scan(const Vec3& a, const Vec3& b, const Vec3& c, F&& f) const {
    return scan_rows(a, b, c, [&](int row, int first, int last) {
      const std::size_t base = std::size_t(row) * row_length();
      const double y = y0 - double(row) * dy;
      for (int i = first; i <= last; ++i) {
        const double h = z[base + i];
        if (std::isnan(h)) continue;
        if (!f(x0 + double(i) * dx, y, h + offset, base + std::size_t(i))) return false;
      }
      return true;
    });
  }

  template <class F>
  bool scan_outside(const Vec3& a, const Vec3& b, const Vec3& c, const Band& band, F&& f) const {
    if (band.open()) return scan(a, b, c, f);
    // Groups read up to three samples beyond the row: those of the next rows, as far as there
    // are any.
    const std::size_t end = std::size_t(rows - 1) * row_length() + std::size_t(cols);
    return scan_rows(a, b, c, [&](int row, int first, int last) {
      const std::size_t base = std::size_t(row) * row_length();
      const double y = y0 - double(row) * dy;
      int i = first;
      if (last - first >= kManySamples) {
        RowBand between(band, *this, i, y);
        for (; last - i >= 15 && !any(between.outside_of_16(&z[base + i])); i += 16)
          between.next(4);
        while (i <= last && base + std::size_t(i) + 4 <= end) {
          const Lanes outside = between.outside(&z[base + i]);
          const int n = std::min(4, last - i + 1);
          if (any(outside, n)) break;
          between.next(1);
          i += 4;
        }
        if (i > last) return true;
      }
      return scan_row(band, base, y, i, last, f);
    });
  }

 private:
  using Floats = float __attribute__((vector_size(16)));
  using Lanes = int __attribute__((vector_size(16)));
  using Halves = long long __attribute__((vector_size(16)));
  static constexpr int kManySamples = 12;  // of a row: worth the preparation of RowBand

  /// Those of a row that may lie outside the band, one by one.
  template <class F>
  bool scan_row(const Band& band, std::size_t base, double y, int i, int last, F&& f) const {
    double top, bottom, top_step, bottom_step;
    const auto from = [&](int col) {
      const double u = x0 + double(col) * dx - band.x, v = y - band.y, zero = band.z - offset;
      top = zero + band.top + (band.top_x * u + band.top_y * v), top_step = band.top_x * dx;
      bottom = zero + band.bottom + (band.bottom_x * u + band.bottom_y * v);
      bottom_step = band.bottom_x * dx;
    };
    from(i);
    for (; i <= last; ++i, top += top_step, bottom += bottom_step) {
      const double h = z[base + i];
      if (!(h > top || h < bottom)) continue;  // nor where it is NaN
      if (!f(x0 + double(i) * dx, y, h + offset, base + std::size_t(i))) return false;
      from(i);  // f may have narrowed it
    }
    return true;
  }

  /// The two planes of a band along a row, at four columns at a time, in float with room for its
  /// rounding: float keeps 24 bits of the planes' values, and of the heights' distance from z. From
  /// group to group they go on in double, so that rounding does not add up along a row.
  struct RowBand {
    double top, bottom, top_step, bottom_step;  // at the first of the four, above `base`
    Floats top_lanes, bottom_lanes;             // from there to each
    float base;

    RowBand(const Band& band, const GridSamples& s, int col, double y) {
      constexpr Floats kLanes = {0, 1, 2, 3};
      const double u = s.x0 + double(col) * s.dx - band.x, v = y - band.y, zero = band.z - s.offset;
      const double slack = 5e-7 * (band.size + std::abs(zero) * 0.25);
      top = band.top + (band.top_x * u + band.top_y * v) - slack;
      bottom = band.bottom + (band.bottom_x * u + band.bottom_y * v) + slack;
      top_step = 4 * band.top_x * s.dx, bottom_step = 4 * band.bottom_x * s.dx;
      top_lanes = float(band.top_x * s.dx) * kLanes;
      bottom_lanes = float(band.bottom_x * s.dx) * kLanes;
      base = float(zero);
    }
    Lanes outside(const float* at) const {
      Floats h;
      std::memcpy(&h, at, sizeof h);
      h -= base;
      return Lanes(h > float(top) + top_lanes) | Lanes(h < float(bottom) + bottom_lanes);
    }
    /// The same of four groups at once: of each lane whether one of its four is outside.
    Lanes outside_of_16(const float* at) const {
      const float up = float(top_step), down = float(bottom_step);
      Floats highest = float(top) + top_lanes, lowest = float(bottom) + bottom_lanes;
      Lanes outside = {};
      for (int k = 0; k < 4; ++k, highest += up, lowest += down) {
        Floats h;
        std::memcpy(&h, at + 4 * k, sizeof h);
        h -= base;
        outside |= Lanes(h > highest) | Lanes(h < lowest);
      }
      return outside;
    }
    void next(int groups) { top += groups * top_step, bottom += groups * bottom_step; }
  };

  static bool any(Lanes lanes) {
    const Halves both = Halves(lanes);
    return (both[0] | both[1]) != 0;
  }
  static bool any(Lanes lanes, int n) {
    static constexpr int kMask[8] = {-1, -1, -1, -1, 0, 0, 0, 0};
    Lanes mask;
    std::memcpy(&mask, kMask + (4 - n), sizeof mask);
    return any(lanes & mask);
  }

  // std::ceil and std::floor are calls into the library on plain x86-64.
  static int at_or_after(double v) {
    const int i = int(v);
    return i + (double(i) < v);
  }
  static int at_or_before(double v) {
    const int i = int(v);
    return i - (double(i) > v);
  }

  /// f(row, first column, last column) for each row that has samples in the triangle.
  template <class F>
  bool scan_rows(const Vec3& a, const Vec3& b, const Vec3& c, F&& f) const {
    constexpr double kHair = 1e-7;  // of a sample step
    // By height, and without branches: no order is likelier than another.
    const bool ab = a.y >= b.y, bc = b.y >= c.y, ac = a.y >= c.y;
    const int place_a = !ab + !ac, place_b = ab + !bc;
    const Vec3* order[3];
    order[place_a] = &a, order[place_b] = &b, order[3 - place_a - place_b] = &c;
    const auto [top, mid, low] = order;  // the three places differ, which the analyzer cannot see
    // Row coordinates grow downwards.
    const double per_x = 1 / dx, per_y = 1 / dy;
    const double top_row = (y0 - top->y) * per_y;  // NOLINT(clang-analyzer-core.NullDereference)
    const double mid_row = (y0 - mid->y) * per_y;
    const double low_row = (y0 - low->y) * per_y;
    const int first = std::max(0, at_or_after(top_row - kHair));
    const int last = std::min(rows - 1, at_or_before(low_row + kHair));
    if (first > last) return true;
    const double top_col = (top->x - x0) * per_x, mid_col = (mid->x - x0) * per_x;
    const double low_col = (low->x - x0) * per_x;
    const auto span = [&](int row, double left, double right) {
      if (right < -kHair) return true;
      const int i =
          std::max(0, int(left + (1 - kHair)));  // the next whole number, were it 0 or more
      const int j = std::min(cols - 1, int(right + kHair));
      return i > j || f(row, i, j);
    };
    if (!(low_row > top_row))  // all on one row
      return span(first, std::min({top_col, mid_col, low_col}),
                  std::max({top_col, mid_col, low_col}));
    const double along = (low_col - top_col) / (low_row - top_row);
    // The rows above the middle corner, then those from it on; a hair outside counts as the corner.
    const auto half = [&](int from, int to, double row0, double col0, double slope) {
      for (int row = from; row <= to; ++row) {
        const double r = std::clamp(double(row), top_row, low_row);
        const double one = top_col + (r - top_row) * along, other = col0 + (r - row0) * slope;
        if (!span(row, std::min(one, other), std::max(one, other))) return false;
      }
      return true;
    };
    // The first row with !(clamp(row) < mid_row).
    int middle = std::clamp(at_or_after(mid_row), first, last + 1);
    if (!(top_row < mid_row)) middle = first;
    const double upper = mid_row > top_row ? (mid_col - top_col) / (mid_row - top_row) : 0;
    const double lower = low_row > mid_row ? (low_col - mid_col) / (low_row - mid_row) : 0;
    return half(first, middle - 1, top_row, top_col, upper) &&
           half(middle, last, mid_row, mid_col, lower);
  }
};

/// Samples anywhere, in buckets of a uniform grid over the square from `low` to low + extent.
class ScatteredSamples {
 public:
  double offset = 0;

  ScatteredSamples() = default;
  /// Copies the valid (non-NaN) points; about `per_bucket` of them share a bucket. Distances are
  /// meant to be whole numbers, more or less: a hair is a share of one.
  ScatteredSamples(std::span<const Vec3> points, double extent, double per_bucket = 2,
                   Vec2 low = {});

  /// No needle, either: three vertices of a straight border lie on one line but for rounding, and
  /// a triangle of them is a wall, in which the samples that it passes by are lost to every
  /// measure. The limit is ten times the hair of scan(), and far below the distance of samples.
  static bool takes(const Vec3& a, const Vec3& b, const Vec3& c) {
    constexpr double kLeastBreadth2 = 1e-12;
    const double area = orient2d(a, b, c);
    const double longest2 = std::max({squared_xy(a, b), squared_xy(b, c), squared_xy(c, a)});
    return surely_ccw(a, b, c) && area * area > kLeastBreadth2 * longest2;
  }

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
    const int first_col = bucket(min_x - low_.x), last_col = bucket(max_x - low_.x);
    const int last_row = bucket(max_y - low_.y);
    for (int row = bucket(min_y - low_.y); row <= last_row; ++row) {
      const std::size_t base = std::size_t(row) * side_;
      const std::uint32_t first = start_[base + first_col];
      const std::uint32_t last = start_[base + last_col + 1];
      for (std::uint32_t i = first; i < last; ++i) {
        const Vec3& p = points_[i];
        if (p.x < min_x || p.x > max_x || p.y < min_y || p.y > max_y) continue;
        if (orient2d(a, b, p) < -ab || orient2d(b, c, p) < -bc || orient2d(c, a, p) < -ca) continue;
        if (!f(p.x, p.y, p.z + offset, std::size_t(i))) return false;
      }
    }
    return true;
  }

  template <class F>
  bool scan_outside(const Vec3& a, const Vec3& b, const Vec3& c, const Band&, F&& f) const {
    return scan(a, b, c, f);  // where each sample is looked at anyway, f may as well decide
  }

 private:
  int side_ = 1;
  double scale_ = 0;
  Vec2 low_;
  std::vector<Vec3> points_;
  std::vector<std::uint32_t> start_ = {0, 0};

  int bucket(double t) const { return std::clamp(int(t * scale_), 0, side_ - 1); }
};

}  // namespace tind
