#pragma once
// The referee of view-dependent refinement: every post and what is drawn in its place, through
// a projection of its own (nothing of terrain/progressive/multires/camera.h but the numbers of
// the camera).

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "terrain/mesh/tin.h"
#include "terrain/progressive/multires/camera.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"

namespace tind::test {

struct Pinhole {
  Vec3 eye, right, up, ahead;
  double focal, half_w, half_h;

  static Vec3 ecef(double lon_deg, double lat_deg, double h) {
    const double lon = lon_deg * std::numbers::pi / 180, lat = lat_deg * std::numbers::pi / 180;
    const double f = 1 / 298.257223563, e2 = f * (2 - f);
    const double n = 6378137.0 / std::sqrt(1 - e2 * std::sin(lat) * std::sin(lat));
    return {(n + h) * std::cos(lat) * std::cos(lon), (n + h) * std::cos(lat) * std::sin(lon),
            (n * (1 - e2) + h) * std::sin(lat)};
  }

  explicit Pinhole(const Camera& c) {
    const double d = std::numbers::pi / 180;
    const double lon = c.position.lon * d, lat = c.position.lat * d;
    const Vec3 east{-std::sin(lon), std::cos(lon), 0};
    const Vec3 zenith{std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
    const Vec3 north = cross(zenith, east);
    const double h = c.heading_deg * d, p = c.pitch_deg * d, r = c.roll_deg * d;
    const Vec3 flat = north * std::cos(h) + east * std::sin(h);
    ahead = flat * std::cos(p) + zenith * std::sin(p);
    const Vec3 r0 = cross(flat, zenith), u0 = cross(r0, ahead);
    right = r0 * std::cos(r) - u0 * std::sin(r);  // the right wing goes down
    up = u0 * std::cos(r) + r0 * std::sin(r);
    eye = ecef(c.position.lon, c.position.lat, c.height_m);
    half_w = c.width_px / 2.0, half_h = c.height_px / 2.0;
    focal = half_w / std::tan(c.fov_deg * d / 2);
  }

  bool project(const Vec3& at, double& x, double& y) const {
    const Vec3 v = at - eye;
    const double z = dot(v, ahead);
    if (z <= 0) return false;
    x = focal * dot(v, right) / z, y = focal * dot(v, up) / z;
    return true;
  }
};

/// Posts of a plain geographic DEM on the ellipsoid.
inline std::vector<Vec3> post_places(const HeightGrid& grid, const Affine& post_to_lonlat) {
  std::vector<Vec3> out(grid.size());
  for (int r = 0; r < grid.rows(); ++r)
    for (int c = 0; c < grid.cols(); ++c) {
      const Vec2 p = post_to_lonlat.apply(c, r);
      out[std::size_t(r) * grid.cols() + c] = Pinhole::ecef(p.x, p.y, grid.at(c, r));
    }
  return out;
}

struct InView {
  std::size_t posts = 0;   // in the picture (twice on a shared edge)
  double worst_px = 0;     // between post and what is drawn for it
  double nearest_m = 1e9;  // depth of the nearest post
};

/// `mesh` in post coordinates, as one draws it: flat triangles between corners on the ellipsoid.
inline InView look_at_posts(const Tin& mesh, const HeightGrid& grid,
                            const std::vector<Vec3>& places, const Affine& post_to_lonlat,
                            const Camera& camera) {
  const Pinhole eye(camera);
  InView out;
  std::vector<Vec3> corner;
  for (const Vec3& v : mesh.vertices) {
    const Vec2 p = post_to_lonlat.apply(v.x, -v.y);
    corner.push_back(Pinhole::ecef(p.x, p.y, v.z));
  }
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const double area = orient2d(a, b, c);
    const int c0 = int(std::ceil(std::min({a.x, b.x, c.x}) - 1e-9)),
              c1 = int(std::floor(std::max({a.x, b.x, c.x}) + 1e-9)),
              r0 = int(std::ceil(-std::max({a.y, b.y, c.y}) - 1e-9)),
              r1 = int(std::floor(-std::min({a.y, b.y, c.y}) + 1e-9));
    for (int r = r0; r <= r1; ++r)
      for (int col = c0; col <= c1; ++col) {
        const Vec3 p{double(col), -double(r), 0};
        const double u = orient2d(b, c, p) / area, v = orient2d(c, a, p) / area, w = 1 - u - v;
        if (u < -1e-9 || v < -1e-9 || w < -1e-9 || grid.is_void(col, r)) continue;
        const Vec3& post = places[std::size_t(r) * grid.cols() + col];
        double x, y, qx, qy;
        if (!eye.project(post, x, y) || std::abs(x) > eye.half_w || std::abs(y) > eye.half_h)
          continue;
        ++out.posts;
        out.nearest_m = std::min(out.nearest_m, dot(post - eye.eye, eye.ahead));
        const Vec3 drawn = corner[t[0]] * u + corner[t[1]] * v + corner[t[2]] * w;
        const bool seen = eye.project(drawn, qx, qy);
        out.worst_px = std::max(out.worst_px, seen ? std::hypot(x - qx, y - qy) : 1e9);
      }
  }
  return out;
}

/// A camera anywhere over the DEM, 100 m to 10 km above the ground, looking anywhere.
inline Camera random_camera(const HeightGrid& grid, const Affine& post_to_lonlat,
                            std::mt19937& random) {
  std::uniform_real_distribution<double> one(0, 1);
  const double col = one(random) * (grid.cols() - 1), row = one(random) * (grid.rows() - 1);
  const Vec2 at = post_to_lonlat.apply(col, row);
  const float ground = grid.at(int(col), int(row));
  Camera c;
  c.position = {at.x, at.y};
  c.height_m = (std::isnan(ground) ? 0.0 : double(ground)) + 100 * std::pow(100, one(random));
  c.heading_deg = 360 * one(random);
  c.pitch_deg = -60 + 65 * one(random);
  c.roll_deg = -30 + 60 * one(random);
  return c;
}

}  // namespace tind::test
