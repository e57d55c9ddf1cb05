#pragma once
// The filter behind --max-error: a collapse may happen only if every post under the changed star
// stays within the bound of the new triangles. So even a classic cost function, which only
// estimates the error, ends with a guarantee.
//
// Why it holds: a triangle of the result either was in the input, with no error at all, or was
// tested when it was made. The final measurement uses the same arithmetic, so it finds no post
// beyond the bound.

#include "terrain/raster/height_grid.h"
#include "terrain/simplify/common/terrain_mesh.h"

namespace tind {

class WithinError {
 public:
  /// The bound is taken a billionth tighter, for the rounding of a later change of frame.
  WithinError(const HeightGrid& grid, double max_error_m)
      : grid_(grid), limit_(max_error_m * (1 - 1e-9)) {}

  /// Nothing flips, and nothing leaves the bound. O(posts of the new star), early out.
  bool allows(const HalfedgeMesh&, HalfedgeMesh::Index h, const Vec3& at) const;

  /// One triangle: every valid post in it is within the bound. REQUIRES: counter-clockwise.
  bool holds(const Vec3& a, const Vec3& b, const Vec3& c) const;

 private:
  const HeightGrid& grid_;
  double limit_;
};

}  // namespace tind
