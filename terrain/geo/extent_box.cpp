#include "terrain/geo/extent_box.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <vector>

#include "terrain/geo/longitude.h"

namespace tind {

GeoRect box_around(std::span<const GeoRect> rects) {
  assert(!rects.empty());
  std::vector<GeoRect> by_west(rects.begin(), rects.end());
  std::ranges::sort(by_west, {}, &GeoRect::west);
  GeoRect box = by_west[0];
  for (const GeoRect& r : by_west) {
    box.south = std::min(box.south, r.south), box.north = std::max(box.north, r.north);
    box.east = std::max(box.east, r.east);
  }
  // As long as no gap is wider, the one left out is that across the antimeridian.
  const double all_west = box.west, all_east = box.east;
  double widest = all_west + 360 - all_east, reached = by_west[0].east;
  for (const GeoRect& r : by_west) {
    if (r.west - reached > widest) {
      widest = r.west - reached;
      box.west = r.west, box.east = reached + 360;
    }
    reached = std::max(reached, r.east);
  }
  return box;
}

GeoRect grown(const GeoRect& r, double metres) {
  constexpr double kDegree_m = 111320, kRadian = std::numbers::pi / 180, kNearPole = 89;
  const double up = metres / kDegree_m;
  const double lat = std::max(std::abs(r.south), std::abs(r.north)) + up;
  if (lat > kNearPole) return {-180, r.south - up, 180, r.north + up};
  const double across = up / std::cos(lat * kRadian);
  return {r.west - across, r.south - up, r.east + across, r.north + up};
}

Geographic place_in(std::span<const GeoRect> rects) {
  const auto middle = [](const GeoRect& r) {
    const Geographic p{(r.west + r.east) / 2, (r.south + r.north) / 2};
    return p.lon >= -180 && p.lon <= 180 ? p : within_first_turn(p);
  };
  const Geographic p = middle(box_around(rects));
  if (std::ranges::any_of(rects, [&](const GeoRect& r) { return r.contains(p); })) return p;
  return middle(*std::ranges::max_element(rects, {},
                                          [](const GeoRect& r) { return r.width() * r.height(); }));
}

}  // namespace tind
