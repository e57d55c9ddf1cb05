#pragma once
// The plane of a triangle as a function of the place, z = z(a) + gx (x - a.x) + gy (y - a.y), for
// whoever asks for heights inside it.
//
// All of it is a handful of operations in a fixed order: two callers agree to the last bit.

#include <algorithm>

#include "terrain/mesh/tin.h"

namespace tind {

/// What z gains along x and along y in the plane of abc, both times twice the triangle's area
/// (orient2d): for whoever divides by that himself, or has it at hand as a reciprocal.
inline Vec2 slope_times_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  return {(b.z - a.z) * (c.y - a.y) - (c.z - a.z) * (b.y - a.y),
          (c.z - a.z) * (b.x - a.x) - (b.z - a.z) * (c.x - a.x)};
}

/// The gradient of the plane of abc: what z gains for a unit of x, and of y. REQUIRES: the triangle
/// has an area seen from above; either orientation.
inline Vec2 gradient(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double area = orient2d(a, b, c);
  const Vec2 slope = slope_times_area(a, b, c);
  return {slope.x / area, slope.y / area};
}

/// Heights are counted from corner a, so those near it lose nothing to far coordinates.
struct TrianglePlane {
  Vec3 a;
  Vec2 slope;

  /// REQUIRES: as gradient().
  TrianglePlane(const Vec3& first, const Vec3& b, const Vec3& c)
      : a(first), slope(gradient(first, b, c)) {}

  double at(double x, double y) const { return a.z + slope.x * (x - a.x) + slope.y * (y - a.y); }
};

/// The same for slivers, too, in which a plane loses its digits: a height between those of the
/// corners, whatever rounding does. Which corner comes first changes the last bit at most, and
/// where the triangle lies beside the axes and how large it is (by powers of two) not even that.
/// REQUIRES: counter-clockwise, p inside or a hair outside.
inline double height_in(const Vec3& a, const Vec3& b, const Vec3& c, double x, double y) {
  const Vec3 p{x, y, 0};
  const double u = std::max(0.0, orient2d(b, c, p)), v = std::max(0.0, orient2d(c, a, p)),
               w = std::max(0.0, orient2d(a, b, p)), sum = u + v + w;
  if (!(sum > 0)) return a.z;
  return a.z + (v * (b.z - a.z) + w * (c.z - a.z)) / sum;
}

}  // namespace tind
