// The octahedron |x| + |y| + |z| = 1, its lower half folded out over the corners of the square.

#include "terrain/tile/normals.h"

#include <algorithm>
#include <numbers>

namespace tind {
namespace {

double sign(double x) { return x < 0 ? -1 : 1; }

void fold(double& x, double& y) {
  const double unfolded = x;
  x = (1 - std::abs(y)) * sign(unfolded);
  y = (1 - std::abs(unfolded)) * sign(y);
}

std::uint8_t to_byte(double x) {
  return std::uint8_t(std::floor((std::clamp(x, -1.0, 1.0) * 0.5 + 0.5) * 255 + 0.5));
}

double from_byte(std::uint8_t b) { return b / 255.0 * 2 - 1; }

}  // namespace

std::array<std::uint8_t, 2> oct_encode(const Vec3& unit) {
  const double size = std::abs(unit.x) + std::abs(unit.y) + std::abs(unit.z);
  double x = unit.x / size, y = unit.y / size;
  if (unit.z < 0) fold(x, y);
  return {to_byte(x), to_byte(y)};
}

Vec3 oct_decode(std::array<std::uint8_t, 2> code) {
  double x = from_byte(code[0]), y = from_byte(code[1]);
  const double z = 1 - (std::abs(x) + std::abs(y));
  if (z < 0) fold(x, y);
  const Vec3 v{x, y, z};
  return v * (1 / length(v));
}

Vec3 ecef_normal(Geographic p, double dz_dx_east, double dz_dy_north) {
  constexpr double kRadians = std::numbers::pi / 180;
  const double sin_lon = std::sin(p.lon * kRadians), cos_lon = std::cos(p.lon * kRadians);
  const double sin_lat = std::sin(p.lat * kRadians), cos_lat = std::cos(p.lat * kRadians);
  const Vec3 east{-sin_lon, cos_lon, 0};
  const Vec3 north{-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat};
  const Vec3 up{cos_lat * cos_lon, cos_lat * sin_lon, sin_lat};
  const Vec3 normal = up - east * dz_dx_east - north * dz_dy_north;
  return normal * (1 / length(normal));
}

}  // namespace tind
