#pragma once
// A part of the plane in which a finer mesh is wanted: a polygon, or a corridor along a route.

#include <vector>

#include "terrain/geo/coordinates.h"

namespace tind {

class Region {
 public:
  /// The inside of a closed ring, either orientation, even-odd; its edge belongs to it. Post
  /// coordinates (x = col, y = -row). REQUIRES: at least three points.
  static Region polygon(std::vector<Vec2> ring);

  /// All that is at most half_width_m from the route, in metres of the post spacing. REQUIRES: at
  /// least two points.
  static Region corridor(const std::vector<Vec2>& route, double half_width_m, double metres_x,
                         double metres_y);

  bool contains(Vec2 post) const;

  /// True when any point of the triangle is in the region. O(points).
  bool touches(const Vec3& a, const Vec3& b, const Vec3& c) const;

 private:
  Vec2 scaled(double x, double y) const { return {x * metres_x_, y * metres_y_}; }
  std::vector<Vec2> line_;  // scaled; a ring repeats its first point
  bool ring_ = false;
  double reach_ = 0, metres_x_ = 1, metres_y_ = 1;
  Vec2 low_, high_;  // with the reach
};

}  // namespace tind
