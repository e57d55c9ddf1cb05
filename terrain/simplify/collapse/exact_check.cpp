// Every triangle of the two ends' fans, but the ones that vanish, is scan-converted with its corner
// at the new place. The posts nearest to the vanishing vertices fail first, but so cheap is a
// triangle of a few posts that looking for them costs more than it saves.

#include "terrain/simplify/collapse/exact_check.h"

#include <cmath>

#include "terrain/mesh/scan_triangle.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;

bool triangle_within(const HeightGrid& grid, double limit, const Vec3& a, const Vec3& b,
                     const Vec3& c) {
  return scan_triangle(a, b, c, 0, grid.rows(), grid.cols(), [&](const PostSpan& span) {
    const float* const posts = grid.row(span.row).data();
    for (int col = span.first; col <= span.last; ++col)
      if (std::fabs(span.height(col) - posts[col]) > limit) return false;  // a void passes
    return true;
  });
}

}  // namespace

bool WithinError::holds(const Vec3& a, const Vec3& b, const Vec3& c) const {
  return triangle_within(grid_, limit_, a, b, c);
}

bool WithinError::allows(const HalfedgeMesh& m, Index h, const Vec3& at) const {
  if (!star_stays_ccw(m, h, at)) return false;
  return m.all_kept(h, [&](Index e) {
    return triangle_within(grid_, limit_, at, m.position(m.dest(e)), m.position(m.apex(e)));
  });
}

}  // namespace tind
