#pragma once
// The error of one triangle over the posts it covers: the referee's arithmetic (scan_triangle.h),
// one triangle at a time.

#include <cmath>
#include <limits>

#include "terrain/mesh/scan_triangle.h"
#include "terrain/raster/height_grid.h"

namespace tind {

/// The largest |triangle - post| over the valid posts of triangle abc (post coordinates). Stops as
/// soon as it is above `enough` and returns some value above it.
inline double worst_post(const HeightGrid& grid, const Vec3& a, const Vec3& b, const Vec3& c,
                         double enough = std::numeric_limits<double>::infinity()) {
  double worst = 0;
  scan_triangle(a, b, c, 0, grid.rows(), grid.cols(), [&](const PostSpan& span) {
    const float* const posts = grid.row(span.row).data();
    for (int col = span.first; col <= span.last; ++col) {
      const double e = std::fabs(span.height(col) - posts[col]);
      if (e > worst) worst = e;  // false at a void
    }
    return worst <= enough;
  });
  return worst;
}

/// The nearest float that is not below x.
inline float float_above(double x) {
  const float f = float(x);
  return double(f) < x ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

}  // namespace tind
