#pragma once
// Which side of a line, and whether on it, without rounding: for the points of lines, whose
// coordinates are multiples of 2^-36 below 2^26 (constrained_delaunay.h).

#include <cstdint>

#include "terrain/mesh/tin.h"

namespace tind {

/// Squared distance seen from above.
inline double squared_xy(const Vec3& a, const Vec3& b) {
  return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
}

/// Twice the signed area of abp, in units of 2^-72.
inline __int128 exact_orient(const Vec3& a, const Vec3& b, const Vec3& p) {
  const auto units = [](double v) { return __int128(std::int64_t(v * 0x1p36)); };
  return (units(b.x) - units(a.x)) * (units(p.y) - units(a.y)) -
         (units(b.y) - units(a.y)) * (units(p.x) - units(a.x));
}

/// Beside the segment rather than beyond one of its ends.
inline bool between(const Vec3& a, const Vec3& b, const Vec3& p) {
  return (p.x - a.x) * (b.x - a.x) + (p.y - a.y) * (b.y - a.y) > 0 &&
         (p.x - b.x) * (a.x - b.x) + (p.y - b.y) * (a.y - b.y) > 0;
}

/// On the segment, its ends left out.
inline bool on_segment(const Vec3& a, const Vec3& b, const Vec3& p) {
  return exact_orient(a, b, p) == 0 && between(a, b, p);
}

}  // namespace tind
