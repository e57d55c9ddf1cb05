#pragma once
// Which posts lie in a triangle, and how high the triangle is there: the one rasteriser behind the
// referee (vertical_error) and behind every exact error bound.
//
// A triangle is closed: posts on its edges and corners belong to it, so a post on a shared edge is
// seen by both triangles, and rounding cannot let it fall between them: an edge's crossing with a
// row is computed from its two ends in a fixed order, whichever triangle asks, and posts within
// kSlack of a post spacing outside still count (meshes read back from a file in map coordinates are
// off by that much): where an edge is level but for that, its row takes all of it. Heights are
// interpolated along the two edges, then between them, so even a sliver's heights stay between
// those of its corners. The result depends on the three points only, not on their order: a filter
// and the referee agree to the last bit.

#include <algorithm>
#include <cmath>

#include "terrain/geo/coordinates.h"

namespace tind {

/// Posts first..last of a row; the triangle's height at column c is z0 + (c - x0) * slope.
struct PostSpan {
  int row, first, last;
  double x0, z0, slope;
  double x1;  // the triangle covers x0..x1 of the row

  double height(int col) const { return z0 + (col - x0) * slope; }
};

namespace detail {

inline constexpr double kSlack = 1e-8;         // posts
inline constexpr double kNarrow = 1.0 / 4096;  // below this width a span holds one post at most

/// An edge that runs down the rows, as functions of the row.
struct ScanEdge {
  double row, x, z, height, dx, dz;

  ScanEdge(const Vec3& top, const Vec3& bottom)
      : row(-top.y), x(top.x), z(top.z), height(top.y - bottom.y), dx(0), dz(0) {
    if (height > 0) {
      dx = (bottom.x - top.x) / height;
      dz = (bottom.z - top.z) / height;
    }
  }
  double down(double r) const { return std::clamp(r - row, 0.0, height); }
};

inline int first_at_or_after(double v) {
  v = std::clamp(v, -1e9, 1e9);
  const int i = int(v);
  return i + (double(i) < v);
}
inline int last_at_or_before(double v) {
  v = std::clamp(v, -1e9, 1e9);
  const int i = int(v);
  return i - (double(i) > v);
}

}  // namespace detail

/// Calls f(PostSpan) for each row in [row_begin, row_end) that has posts of columns [0, cols) in
/// the triangle; f returns false to stop. False when it was stopped. x = col, y = -row; either
/// orientation. REQUIRES: coordinates are finite.
template <class F>
inline bool scan_triangle(const Vec3& p, const Vec3& q, const Vec3& r, int row_begin, int row_end,
                          int cols, F&& f, double slack = detail::kSlack) {
  using namespace detail;
  const auto above = [](const Vec3& a, const Vec3& b) {
    return a.y > b.y || (a.y == b.y && a.x < b.x);
  };
  const Vec3 *top = &p, *mid = &q, *bottom = &r;
  if (above(*mid, *top)) std::swap(mid, top);
  if (above(*bottom, *mid)) std::swap(bottom, mid);
  if (above(*mid, *top)) std::swap(mid, top);

  const int begin = std::max(row_begin, first_at_or_after(-top->y - slack));
  const int end = std::min(row_end, last_at_or_before(-bottom->y + slack) + 1);
  if (begin >= end) return true;
  const ScanEdge side(*top, *bottom), upper(*top, *mid), lower(*mid, *bottom);
  for (int row = begin; row < end; ++row) {
    const ScanEdge& other = upper.height > 0 && row <= lower.row ? upper : lower;
    const double s = side.down(row), o = other.down(row);
    double xl = side.x + s * side.dx, zl = side.z + s * side.dz;
    double xr = other.x + o * other.dx, zr = other.z + o * other.dz;
    if (side.height == 0) xr = bottom->x, zr = bottom->z;  // all three on one row
    if (xr < xl) std::swap(xl, xr), std::swap(zl, zr);
    for (const Vec3* corner : {top, mid, bottom}) {
      const double off = std::abs(row + corner->y);
      if (!(off > 0 && off <= slack)) continue;
      if (corner->x < xl) xl = corner->x, zl = corner->z;
      if (corner->x > xr) xr = corner->x, zr = corner->z;
    }
    PostSpan span{row,
                  std::max(0, first_at_or_after(xl - slack)),
                  std::min(cols - 1, last_at_or_before(xr + slack)),
                  xl,
                  zl,
                  0,
                  xr};
    if (span.first > span.last) continue;
    const double width = xr - xl;
    if (width >= kNarrow)
      span.slope = (zr - zl) / width;
    else if (width > 0)
      span.z0 = zl + std::clamp((span.first - xl) / width, 0.0, 1.0) * (zr - zl);
    if (!f(span)) return false;
  }
  return true;
}

}  // namespace tind
