// Everything happens in camera coordinates: x right, y down, z ahead.

#include "terrain/progressive/multires/camera.h"

#include <algorithm>
#include <numbers>

#include "terrain/geo/ellipsoid.h"

namespace tind {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kEarth = 6356752;  // the smallest radius: errs to more sag

Vec3 unit(const Vec3& v) { return v * (1 / length(v)); }

}  // namespace

LocalFrame LocalFrame::at(Geographic p) {
  const double lon = p.lon * kDegree, lat = p.lat * kDegree;
  LocalFrame f;
  f.lat_deg = p.lat;
  f.origin = wgs84::to_ecef(p, 0);
  f.up = wgs84::up(p);
  f.east = {-std::sin(lon), std::cos(lon), 0};
  f.north = {-std::sin(lat) * std::cos(lon), -std::sin(lat) * std::sin(lon), std::cos(lat)};
  return f;
}

View::View(const Camera& c, const LocalFrame& frame, double extent_m)
    : eye_(frame.from_ecef(wgs84::to_ecef(c.position, c.height_m))), extent_m_(extent_m) {
  const LocalFrame here = LocalFrame::at(c.position);
  const double heading = c.heading_deg * kDegree, pitch = c.pitch_deg * kDegree,
               roll = c.roll_deg * kDegree;
  const auto turned = [&](double e, double n, double u) {
    const Vec3 v = here.east * e + here.north * n + here.up * u;
    return Vec3{dot(v, frame.east), dot(v, frame.north), dot(v, frame.up)};
  };
  ahead_ = turned(std::sin(heading) * std::cos(pitch), std::cos(heading) * std::cos(pitch),
                  std::sin(pitch));
  const Vec3 level = turned(std::cos(heading), -std::sin(heading), 0);
  const Vec3 below = cross(ahead_, level);
  right_ = level * std::cos(roll) + below * std::sin(roll);
  down_ = below * std::cos(roll) - level * std::sin(roll);

  tan_x_ = std::tan(c.fov_deg * kDegree / 2);
  tan_y_ = tan_x_ * c.height_px / c.width_px;
  focal_px_ = c.width_px / 2.0 / tan_x_;
  tolerance_ = c.tolerance_px;
  silhouette_ = c.silhouette_px > 0 ? std::min(c.silhouette_px, c.tolerance_px) : 0;
  sides_[0] = unit({1, 0, tan_x_}), sides_[1] = unit({-1, 0, tan_x_});
  sides_[2] = unit({0, 1, tan_y_}), sides_[3] = unit({0, -1, tan_y_});

  // The ground's own "up" is taken as (x / R, y / R, 1) in the local frame: what that leaves out.
  const double bend = extent_m / kEarth;
  const double cos_lat =
      std::max(0.05, std::cos(std::min(89.0, std::abs(frame.lat_deg) + bend / kDegree) * kDegree));
  up_margin_ = 1e-3 + 0.02 * bend + bend * bend / cos_lat;
  sag_per_m2_ = 0.2 / (kEarth * cos_lat);
}

View::Verdict View::judge(const std::array<float, 3>& a, const std::array<float, 3>& b,
                          const std::array<float, 3>& c, double error_m, int steepest_deg) const {
  const Vec3 local[3] = {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, {c[0], c[1], c[2]}};
  Vec3 p[3];
  for (int k = 0; k < 3; ++k) {
    const Vec3 d = local[k] - eye_;
    p[k] = {dot(d, right_), dot(d, down_), dot(d, ahead_)};
  }
  const Vec3 e0 = p[1] - p[0], e1 = p[2] - p[1], e2 = p[0] - p[2];
  const double sag = sag_per_m2_ * std::max({dot(e0, e0), dot(e1, e1), dot(e2, e2)});
  const double reach = error_m + sag;
  const double near = std::min({p[0].z, p[1].z, p[2].z});

  double outside = -std::max({p[0].z, p[1].z, p[2].z}) - reach;
  double exit = std::max({p[0].z, p[1].z, p[2].z}) + reach;
  for (const Vec3& n : sides_) {
    const double in = std::max({dot(n, p[0]), dot(n, p[1]), dot(n, p[2])}) + reach;
    outside = std::max(outside, -in);
    exit = std::min(exit, in);
  }
  if (outside > 0) return {false, outside};
  if (near <= reach) return {true, std::max(0.0, exit)};

  // The part of the picture where its posts can be.
  double x0 = tan_x_, x1 = -tan_x_, y0 = tan_y_, y1 = -tan_y_, far_t = 0;
  for (const Vec3& q : p) {
    const double x = q.x / q.z, y = q.y / q.z;
    x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
    far_t = std::max(far_t, x * x + y * y);
  }
  const double wide = reach * (1 + far_t) / (near - reach);
  x0 = std::clamp(x0 - wide, -tan_x_, tan_x_), x1 = std::clamp(x1 + wide, -tan_x_, tan_x_);
  y0 = std::clamp(y0 - wide, -tan_y_, tan_y_), y1 = std::clamp(y1 + wide, -tan_y_, tan_y_);
  const Vec3 normal{local[0].x / kEarth, local[0].y / kEarth, 1};
  const Vec3 up{dot(normal, right_), dot(normal, down_), dot(normal, ahead_)};
  const double margin = up_margin_ + std::sqrt(sag / kEarth * 5);  // across one triangle
  double shows = 0, stretch = 0;
  for (const double x : {x0, x1})
    for (const double y : {y0, y1}) {
      shows = std::max(shows, std::hypot(up.x - x * up.z, up.y - y * up.z));
      stretch = std::max(stretch, std::sqrt(1 + x * x + y * y));
    }
  const double metres = error_m * (shows + margin * stretch) + sag * stretch;

  double tolerance = tolerance_;
  if (silhouette_ > 0) {
    double flattest = 90;
    for (const Vec3& q : local)
      flattest = std::min(
          flattest, std::atan2(eye_.z - q.z, std::hypot(q.x - eye_.x, q.y - eye_.y)) / kDegree);
    if (flattest < steepest_deg) tolerance = silhouette_;
  }
  const double need = focal_px_ * metres, have = tolerance * near;
  if (need > have) return {true, std::clamp(need / tolerance - near, 0.0, std::max(0.0, exit))};
  const double safe = silhouette_ > 0 ? std::max(silhouette_ * near, need) : have;
  const double growth = 2 * focal_px_ * error_m * (1 + tan_x_ * tan_x_ + tan_y_ * tan_y_) / near;
  const double slack = 0.9 * (safe - need) / (tolerance + 1.2 * growth);
  return {false, std::min(slack, near / 2)};
}

double View::motion_from(const View& o) const {
  const double angle =
      2 * std::asin(std::min(1.0, std::max({length(right_ - o.right_), length(down_ - o.down_),
                                            length(ahead_ - o.ahead_)}) /
                                      2));
  const double farthest = std::max(length(eye_), length(o.eye_)) + extent_m_;
  return length(eye_ - o.eye_) + 1.5 * angle * farthest;
}

bool View::same_lens(const View& o) const {
  return focal_px_ == o.focal_px_ && tan_x_ == o.tan_x_ && tan_y_ == o.tan_y_ &&
         tolerance_ == o.tolerance_ && silhouette_ == o.silhouette_;
}

}  // namespace tind
