#pragma once
// Triangle meshes as plain arrays: what algorithms take and give.

#include <array>
#include <cstdint>
#include <vector>

#include "terrain/geo/coordinates.h"

namespace tind {

using Triangle = std::array<std::uint32_t, 3>;

/// An indexed triangle mesh. For terrain: x, y in one of the planar frames of coordinates.h, z the
/// height; counter-clockwise seen from above (x right, y up). General meshes may carry attributes,
/// one per vertex, each array empty or as long as `vertices`.
struct Tin {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;

  std::vector<std::array<float, 3>> colours;    // r g b, 0..1
  std::vector<std::array<float, 3>> normals;    // unit
  std::vector<std::array<float, 2>> texcoords;  // s t
};

/// Twice the signed area of triangle abc seen from above; exact for integer coordinates below 2^25.
inline double orient2d(const Vec3& a, const Vec3& b, const Vec3& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// The test itself, for the two products of the determinant.
inline bool surely_positive(double l, double r) {
  return l - r > 3.3306690738754716e-16 * (std::abs(l) + std::abs(r));
}

/// True only when abc is counter-clockwise with positive area *for certain*: the rounding error of
/// the determinant ([Shewchuk97], ccwerrboundA) is taken off. Exact-integer input loses nothing
/// beyond slivers of relative area 1e-15.
inline bool surely_ccw(const Vec3& a, const Vec3& b, const Vec3& c) {
  return surely_positive((b.x - a.x) * (c.y - a.y), (b.y - a.y) * (c.x - a.x));
}

}  // namespace tind
