// Bounding sphere: the better of two (around the box's middle; [Ritter90]). Occlusion point:
// Ring (2013), "Computing the horizon occlusion point", carried over to depths.
//
// Seen from a camera c, the unit sphere hides a point at distance k on direction d when
//   angle(c, d) > acos(1/|c|) + acos(1/k).
// A vertex p is hidden by the sphere of radius r <= 1 (the earth lowered to the tile's deepest
// vertex) when  angle(c, p) > acos(r/|c|) + acos(r/|p|).
// With angle(c, p) >= angle(c, d) - angle(d, p), the first implies the second if
//   acos(1/k) >= angle(d, p) + acos(r/|p|) + [acos(r/|c|) - acos(1/|c|)].
// The bracket falls with |c|, so its worst value for cameras on or above the ellipsoid is acos(r).
// For r = 1 it vanishes and this is the usual formula, with k the largest over all vertices.

#include "terrain/tile/culling.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <vector>

#include "terrain/geo/ellipsoid.h"

namespace tind {
namespace {

constexpr double kRoundingMargin_m = 1e-3;
// Where a volume stands does not matter to the last bit, and zeros take few bytes once compressed.
constexpr double kPlaceStep_m = 0.125;
constexpr double kGoodEnough = 1.05;

Vec3 rounded(const Vec3& p) {
  const auto round = [](double x) { return std::round(x / kPlaceStep_m) * kPlaceStep_m; };
  return {round(p.x), round(p.y), round(p.z)};
}

double distance(const Vec3& a, const Vec3& b) { return length(a - b); }

struct Sphere {
  Vec3 center;
  double radius = 0;
};

double farthest(const Vec3& center, std::span<const Vec3> points) {
  double largest = 0;
  for (const Vec3& p : points) {
    const Vec3 d = p - center;
    largest = std::max(largest, dot(d, d));
  }
  return std::sqrt(largest);
}

/// Ritter: start with a long diameter, grow by every point outside.
Sphere grown_sphere(const Vec3& a, const Vec3& b, std::span<const Vec3> points) {
  Sphere s{(a + b) * 0.5, distance(a, b) / 2};
  double square = s.radius * s.radius;
  for (const Vec3& p : points) {
    const Vec3 d = p - s.center;
    const double far2 = dot(d, d);
    if (far2 <= square) continue;
    const double far = std::sqrt(far2);
    s.radius = (s.radius + far) / 2;
    square = s.radius * s.radius;
    s.center = p + (s.center - p) * (s.radius / far);
  }
  return s;
}

/// `center` is taken if it is nearly as good as any: what is there twice takes few bytes.
Sphere bounding_sphere(std::span<const Vec3> points, const Vec3& center) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
  std::array<Vec3, 6> extremes{};  // the points with the least and largest x, y, z
  for (const Vec3& p : points) {
    if (p.x < low.x) low.x = p.x, extremes[0] = p;
    if (p.x > high.x) high.x = p.x, extremes[1] = p;
    if (p.y < low.y) low.y = p.y, extremes[2] = p;
    if (p.y > high.y) high.y = p.y, extremes[3] = p;
    if (p.z < low.z) low.z = p.z, extremes[4] = p;
    if (p.z > high.z) high.z = p.z, extremes[5] = p;
  }
  int axis = 0;
  for (int i : {2, 4})
    if (distance(extremes[i], extremes[i + 1]) > distance(extremes[axis], extremes[axis + 1]))
      axis = i;
  const Vec3 middle = (low + high) * 0.5;
  const Sphere grown = grown_sphere(extremes[axis], extremes[axis + 1], points);
  // Growing rounds; the radius that counts is measured afterwards.
  const auto around = [&](const Vec3& c) { return Sphere{c, farthest(c, points)}; };
  Sphere best = around(rounded(middle));
  if (const Sphere s = around(rounded(grown.center)); s.radius < best.radius) best = s;
  if (const Sphere s = around(center); s.radius < kGoodEnough * best.radius) best = s;
  best.radius = std::ceil((best.radius + kRoundingMargin_m) / kPlaceStep_m) * kPlaceStep_m;
  return best;
}

/// max over vertices of angle(d, p) + acos(r/|p|), as its cosine; -1 when beyond a right angle.
struct Widest {
  double cosine = 1;

  void see(const Vec3& direction, const Vec3& scaled, double r) {
    const double size = std::max(r, length(scaled));
    const double cos_a = dot(direction, scaled), sin_a = length(cross(direction, scaled));
    const double sin_b = std::sqrt(std::max(0.0, size * size - r * r));
    // both angles' sines and cosines times |p|
    const double sum = (cos_a * r - sin_a * sin_b) / (size * size);
    cosine = std::min(cosine, sum);
  }
};

Vec3 horizon_occlusion(const Vec3& center, std::span<const Vec3> scaled) {
  const Vec3 along = ellipsoid_scaled(center);
  const Vec3 direction = along * (1 / length(along));
  double r = 1;
  for (const Vec3& p : scaled) r = std::min(r, length(p));
  Widest widest;
  for (const Vec3& p : scaled) widest.see(direction, p, r);
  double cosine = widest.cosine;
  if (r < 1 && cosine > 0) {  // add acos(r)
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    cosine = cosine * r - sine * std::sqrt(1 - r * r);
  }
  constexpr double kAlmostFlat = 1e-9;
  if (cosine < kAlmostFlat) return direction * kUnbounded;
  constexpr double kRoundedUp = 1 + 4 * std::numeric_limits<double>::epsilon();
  return direction * (kRoundedUp / cosine);
}

}  // namespace

Vec3 ellipsoid_scaled(const Vec3& ecef) {
  return {ecef.x / wgs84::kSemiMajor, ecef.y / wgs84::kSemiMajor, ecef.z / wgs84::kSemiMinor};
}

bool hidden_by_horizon(const Vec3& point, const Vec3& camera) {
  const Vec3 to_point = point - camera;
  const double horizon2 = dot(camera, camera) - 1;
  const double along = -dot(to_point, camera);
  if (horizon2 < 0) return along > 0;
  return along > horizon2 && along * along / dot(to_point, to_point) > horizon2;
}

CullingVolumes culling_volumes(const GeoRect& rect, std::span<const Vec3> vertices) {
  assert(!vertices.empty());
  std::vector<Vec3> ecef(vertices.size());
  double low = vertices[0].z, high = low;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Vec3& p = vertices[i];
    ecef[i] = wgs84::to_ecef({p.x, p.y}, p.z);
    low = std::min(low, p.z);
    high = std::max(high, p.z);
  }
  CullingVolumes volumes;
  const Geographic middle{(rect.west + rect.east) / 2, (rect.south + rect.north) / 2};
  volumes.center = rounded(wgs84::to_ecef(middle, (low + high) / 2));
  const Sphere sphere = bounding_sphere(ecef, volumes.center);
  volumes.sphere_center = sphere.center;
  volumes.sphere_radius = sphere.radius;
  for (Vec3& p : ecef) p = ellipsoid_scaled(p);
  volumes.horizon_occlusion = horizon_occlusion(volumes.center, ecef);
  return volumes;
}

}  // namespace tind
