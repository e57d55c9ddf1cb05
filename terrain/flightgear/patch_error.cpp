#include "terrain/flightgear/patch_error.h"

namespace tind::flightgear {

Meeting meet(const Vertical& vertical, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 p = a - vertical.foot, q = b - vertical.foot, r = c - vertical.foot;
  const Vec3 normal = cross(q - p, r - p);
  const double rise = dot(normal, vertical.up);
  Meeting m;
  m.height_m = rise != 0 ? dot(normal, p) / rise : 0;
  // Left of each side, as seen from above.
  const double hair = 1e-6;  // metres
  const auto left = [&](const Vec3& from, const Vec3& to) {
    return dot(cross(from, to), vertical.up) >= -hair * length(to - from);
  };
  m.inside = rise > 0 && left(p, q) && left(q, r) && left(r, p);
  return m;
}

namespace detail {

double bow_units(const GeoRect& r, const Vec3& a, const Vec3& b, const Vec3& c) {
  constexpr double kRadians = std::numbers::pi / 180;
  const double lat = std::max(std::abs(r.south), std::abs(r.north)) * kRadians;
  const Vec2 degree = wgs84::metres_per_degree(std::min(std::abs(r.south), std::abs(r.north)));
  const double x_m = r.width() * degree.x / kTileExtent, y_m = r.height() * degree.y / kTileExtent;
  const double x = std::max({a.x, b.x, c.x}) - std::min({a.x, b.x, c.x});
  const double y = std::max({a.y, b.y, c.y}) - std::min({a.y, b.y, c.y});
  const double square = x * x * x_m * x_m + y * y * y_m * y_m;
  const double metres = square / (2 * wgs84::kSemiMajor) * (1 + std::tan(lat)) + 0.01;
  return std::min(kTileExtent, metres / std::min(x_m, y_m));
}

}  // namespace detail
}  // namespace tind::flightgear
