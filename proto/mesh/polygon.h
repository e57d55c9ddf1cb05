#pragma once
// Faces of many corners as triangles.

#include <cstddef>

namespace tind::proto {

/// Calls f(i, j, k) for the triangles of a convex polygon of n corners, in its own sense. Up to
/// kFanCorners a fan around the first corner, as everybody has it. In a fan of very many each
/// triangle is as long as the polygon and lies in the box of each other, which keeps whoever looks
/// for the nearest: such a polygon is halved over and over instead, and no corner has more than
/// two triangles for each halving.
inline constexpr std::size_t kFanCorners = 64;

/// Those of the corners first..last, whose two ends have an edge already.
template <class F>
void halve_polygon(std::size_t first, std::size_t last, const F& f) {
  if (last - first < 2) return;
  const std::size_t middle = first + (last - first) / 2;
  f(first, middle, last);
  halve_polygon(first, middle, f);
  halve_polygon(middle, last, f);
}

template <class F>
void each_triangle_of(std::size_t n, const F& f) {
  if (n > kFanCorners) return halve_polygon(0, n - 1, f);
  for (std::size_t i = 2; i < n; ++i) f(0, i - 1, i);
}

}  // namespace tind::proto
