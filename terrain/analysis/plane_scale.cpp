// A step along a column and one along a row, as they are in the plane and as they are on the
// ellipsoid, in space, because longitudes are nothing at a pole. The map from one to the other has
// a greatest and a least stretch: the roots of the eigenvalues of its square.

#include "terrain/analysis/plane_scale.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "terrain/geo/ellipsoid.h"

namespace tind {
namespace {

/// A place, and where one column and one row lead from there on the ground, metres: of posts that
/// are farther apart, as a kilometre does, because the scale is another at the next.
struct Steps {
  Vec2 post;
  Vec3 along_col, along_row;
};

/// Not those without a place on the globe.
std::vector<Steps> steps_in(const DemSource& dem, Vec2 low, Vec2 high) {
  constexpr int kPlaces = 5;  // along each side
  constexpr double kStep_m = 1000;
  const double step =
      std::min(1.0, kStep_m / std::max(dem.info().spacing_x_m, dem.info().spacing_y_m));
  std::vector<Vec2> posts;  // threes: a place, a step along its row and along its column
  for (int j = 0; j < kPlaces; ++j)
    for (int i = 0; i < kPlaces; ++i) {
      const Vec2 p{low.x + (high.x - low.x) * i / (kPlaces - 1),
                   low.y + (high.y - low.y) * j / (kPlaces - 1)};
      posts.insert(posts.end(), {p, {p.x + step, p.y}, {p.x, p.y + step}});
    }
  std::vector<Geographic> places(posts.size());
  dem.to_geographic(posts, places);
  std::vector<Steps> all;
  for (std::size_t i = 0; i < places.size(); i += 3) {
    const Vec3 at = wgs84::to_ecef(places[i], 0);
    const Steps steps{posts[i], (wgs84::to_ecef(places[i + 1], 0) - at) * (1 / step),
                      (wgs84::to_ecef(places[i + 2], 0) - at) * (1 / step)};
    if (std::isfinite(length(steps.along_col)) && std::isfinite(length(steps.along_row)))
      all.push_back(steps);
  }
  return all;
}

/// Lengths in the plane by those on the ground, in the directions where that is least and most.
struct Stretch {
  double least, most;
};

Stretch stretch_of(const Steps& steps, const DemInfo& info) {
  const Affine& a = info.post_to_crs;
  const double area = (a.x_col * a.y_row - a.x_row * a.y_col) * info.crs_unit_m;
  // What a metre along x of the plane is on the ground, and one along y.
  const Vec3 x = (steps.along_col * a.y_row - steps.along_row * a.y_col) * (1 / area);
  const Vec3 y = (steps.along_row * a.x_col - steps.along_col * a.x_row) * (1 / area);
  const double middle = (dot(x, x) + dot(y, y)) / 2;
  const double off = std::hypot((dot(x, x) - dot(y, y)) / 2, dot(x, y));
  return {1 / std::sqrt(middle + off), 1 / std::sqrt(middle - off)};
}

}  // namespace

AreaScale area_scale(const DemSource& dem, const PostRings& area) {
  const DemInfo& info = dem.info();
  Vec2 low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
  for (const auto& ring : area)
    for (const Vec2& p : ring) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
  const Vec2 last{double(info.cols - 1), double(info.rows - 1)};
  low = {std::max(low.x, 0.0), std::max(low.y, 0.0)};
  high = {std::min(high.x, last.x), std::min(high.y, last.y)};
  if (!(low.x <= high.x && low.y <= high.y)) return {};
  return area_scale(dem, low, high);
}

AreaScale area_scale(const DemSource& dem, Vec2 low, Vec2 high) {
  const DemInfo& info = dem.info();
  if (info.crs_kind != CrsKind::projected) return {};
  const GroundArea plane(info);
  AreaScale scale{HUGE_VAL, 0};
  for (const Steps& s : steps_in(dem, low, high)) {
    const double times = plane.at(s.post.x, s.post.y) / length(cross(s.along_col, s.along_row));
    if (!std::isfinite(times)) continue;
    scale.least = std::min(scale.least, times), scale.greatest = std::max(scale.greatest, times);
  }
  return scale.greatest > 0 ? scale : AreaScale{};
}

LengthScale length_scale(const DemSource& dem) {
  const DemInfo& info = dem.info();
  if (info.crs_kind != CrsKind::projected) return {};
  LengthScale scale{HUGE_VAL, 0, 1};
  for (const Steps& s : steps_in(dem, {0, 0}, {double(info.cols - 1), double(info.rows - 1)})) {
    const Stretch at = stretch_of(s, info);
    if (!std::isfinite(at.least) || !std::isfinite(at.most)) continue;
    scale.least = std::min(scale.least, at.least);
    scale.greatest = std::max(scale.greatest, at.most);
    scale.uneven = std::max(scale.uneven, at.most / at.least);
  }
  return scale.greatest > 0 ? scale : LengthScale{};
}

}  // namespace tind
