#pragma once
// The referee of a patch: how far are posts from the mesh, seen along the vertical, where triangles
// are straight in space?
//
// In longitude and latitude such triangles have bent sides, by metres for one of 15 km. So which
// triangle a post is over is decided in space; the grid of the patch only says which ones could be.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "terrain/flightgear/bucket_plan.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/mesh/tin.h"
#include "terrain/surface/post_warp.h"
#include "terrain/tile/tile_model.h"

namespace tind::flightgear {

struct PatchShape {
  const GeoRect& rect;
  const Tin& mesh;             // in the grid of the rectangle
  std::span<const Vec3> ecef;  // of its vertices
};

/// A vertical: of all places at a longitude and latitude.
struct Vertical {
  Vec3 foot, up;  // on the ellipsoid; unit
  explicit Vertical(Geographic p) : foot(wgs84::to_ecef(p, 0)), up(wgs84::up(p)) {}
};

/// Where a vertical meets a triangle that is straight in space.
struct Meeting {
  double height_m = 0;  // above the foot; of the triangle's plane where it is not over it
  bool inside = false;  // a hair allowed
};
Meeting meet(const Vertical&, const Vec3& a, const Vec3& b, const Vec3& c);

namespace detail {

/// How far a straight side can leave the one that the grid has, in units of v: no more than its
/// square over the diameter of the earth, times the slope of meridians towards each other.
double bow_units(const GeoRect&, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace detail

/// The largest |mesh - post| over the posts that the mesh covers, and those of the closed rectangle
/// beside it (as far as its sides bend), measured against the triangle next to them; 0 for none.
/// Posts are taken down to the sea as the vertices are.
template <class Samples>
double patch_error(const PatchShape& shape, const Samples& samples, const BucketPlan& plan) {
  const GeoRect& r = shape.rect;
  std::vector<std::uint8_t> met(samples.size());
  double worst = 0;
  const auto measure = [&](const Triangle& t, double u, double v, double z, std::size_t i,
                           bool beside) {
    const Geographic p{r.west + u / kTileExtent * r.width(),
                       std::clamp(r.south + v / kTileExtent * r.height(), -90.0, 90.0)};
    const Meeting m = meet(Vertical(p), shape.ecef[t[0]], shape.ecef[t[1]], shape.ecef[t[2]]);
    if (!m.inside && !beside) return;
    met[i] = 1;
    plan.take_to_sea({&p, 1}, {&z, 1});
    worst = std::max(worst, std::abs(m.height_m - z));
  };
  for (const Triangle& t : shape.mesh.triangles) {
    const auto& vertices = shape.mesh.vertices;
    const Vec3 &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
    const double bow = detail::bow_units(r, a, b, c);
    const Vec3 low{std::min({a.x, b.x, c.x}) - bow, std::min({a.y, b.y, c.y}) - bow, 0};
    const Vec3 high{std::max({a.x, b.x, c.x}) + bow, std::max({a.y, b.y, c.y}) + bow, 0};
    const auto outside = [&](const Vec3& p, const Vec3& q, double u, double v) {
      return orient2d(p, q, {u, v, 0}) < -bow * (std::abs(q.x - p.x) + std::abs(q.y - p.y));
    };
    const auto look = [&](double u, double v, double z, std::size_t i) {
      if (!outside(a, b, u, v) && !outside(b, c, u, v) && !outside(c, a, u, v))
        measure(t, u, v, z, i, false);
      return true;
    };
    samples.scan(low, {high.x, low.y, 0}, high, look);
    samples.scan(low, high, {low.x, high.y, 0}, look);
  }
  for (const Triangle& t : shape.mesh.triangles) {
    const auto& vertices = shape.mesh.vertices;
    samples.scan(vertices[t[0]], vertices[t[1]], vertices[t[2]],
                 [&](double u, double v, double z, std::size_t i) {
                   if (!met[i]) measure(t, u, v, z, i, true);
                   return true;
                 });
  }
  return worst;
}

}  // namespace tind::flightgear
