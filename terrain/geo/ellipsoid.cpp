#include "terrain/geo/ellipsoid.h"

#include <numbers>

namespace tind::wgs84 {

namespace {
constexpr double kRadians = std::numbers::pi / 180;
}

Vec3 to_ecef(Geographic p, double height_m) {
  const double lon = p.lon * kRadians, lat = p.lat * kRadians;
  const double sin_lat = std::sin(lat), cos_lat = std::cos(lat);
  const double n = kSemiMajor / std::sqrt(1 - kEccentricity2 * sin_lat * sin_lat);
  return {(n + height_m) * cos_lat * std::cos(lon), (n + height_m) * cos_lat * std::sin(lon),
          (n * (1 - kEccentricity2) + height_m) * sin_lat};
}

GeographicHeight from_ecef(const Vec3& p) {
  const double rho = std::hypot(p.x, p.y);
  double lat = std::atan2(p.z, rho * (1 - kEccentricity2));
  double n = kSemiMajor;
  for (int i = 0; i < 6; ++i) {
    const double s = std::sin(lat);
    n = kSemiMajor / std::sqrt(1 - kEccentricity2 * s * s);
    lat = std::atan2(p.z + kEccentricity2 * n * s, rho);
  }
  const double s = std::sin(lat), c = std::cos(lat);
  const double height = rho * c + p.z * s - kSemiMajor * kSemiMajor / n;
  return {{std::atan2(p.y, p.x) / kRadians, lat / kRadians}, height};
}

Vec3 up(Geographic p) {
  const double lon = p.lon * kRadians, lat = p.lat * kRadians;
  return {std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
}

Vec2 metres_per_degree(double lat_deg) {
  const double s = std::sin(lat_deg * kRadians), c = std::cos(lat_deg * kRadians);
  const double w = std::sqrt(1 - kEccentricity2 * s * s);
  const double n = kSemiMajor / w;                                   // prime vertical radius
  const double m = kSemiMajor * (1 - kEccentricity2) / (w * w * w);  // meridian radius
  return {n * c * kRadians, m * kRadians};
}

}  // namespace tind::wgs84
