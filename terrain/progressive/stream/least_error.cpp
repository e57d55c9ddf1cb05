// Every sample of the star says: the error is at least weight * z - rest, and at least its
// negative. The largest of these lines is convex in z. From a height, the steepest trouble
// above and below are two lines; where they cross is a lower bound of the error and the next
// height to try ([Kelley60], in one dimension). It ends after a finite number of steps, usually
// three or four.

#include "terrain/progressive/stream/least_error.h"

#include <algorithm>
#include <cmath>

#include "terrain/mesh/scan_triangle.h"

namespace tind {

double triangle_error(const HeightGrid& grid, const Vec3& a, const Vec3& b, const Vec3& c) {
  double worst = 0;
  scan_triangle(a, b, c, 0, grid.rows(), grid.cols(), [&](const PostSpan& span) {
    const float* const posts = grid.row(span.row).data();
    for (int col = span.first; col <= span.last; ++col) {
      const double e = std::fabs(span.height(col) - posts[col]);
      if (e > worst) worst = e;  // a void never is
    }
    return true;
  });
  return worst;
}

LeastHeightError::Active LeastHeightError::active_at(double z) const {
  Active a{{0, 0}, {0, 0}, -HUGE_VAL, -HUGE_VAL};
  for (const Sample& s : samples_) {
    const double off = s.weight * z - s.rest;
    if (off > a.above) a.above = off, a.up = s;
    if (-off > a.below) a.below = -off, a.down = s;
  }
  return a;
}

double LeastHeightError::error_at(double z) const {
  if (samples_.empty()) return 0;
  const Active a = active_at(z);
  return std::max(a.above, a.below);
}

LeastHeightError::Fit LeastHeightError::best(double guess) const {
  if (samples_.empty()) return {guess, 0};
  constexpr int kSteps = 8;
  Fit found{guess, HUGE_VAL};
  double z = guess;
  Active a = active_at(z);
  Sample up = a.up, down = a.down;
  for (int i = 0; i < kSteps; ++i) {
    const double error = std::max(a.above, a.below);
    if (error < found.error) found = {z, error};
    const double slope = up.weight + down.weight;
    if (!(slope > 1e-9)) break;  // what is left does not depend on the height
    z = (up.rest + down.rest) / slope;
    const double bound = up.weight * z - up.rest;
    if (found.error <= bound * 1.02 + 1e-9) break;
    a = active_at(z);
    if (a.above >= a.below)
      up = a.up;
    else
      down = a.down;
  }
  return found;
}

}  // namespace tind
