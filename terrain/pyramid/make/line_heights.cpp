#include "terrain/pyramid/make/line_heights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "terrain/surface/post_warp.h"
#include "terrain/tile/thin_line.h"
#include "terrain/tile/tile_model.h"

namespace tind {
namespace {

constexpr double kMetresPerDegree = 111320;
constexpr int kMostPlaces = 512;  // that are looked at, of a segment
constexpr double kLeastStep = 4;  // units of the grid between them

void give_heights(const TileJob& job, std::vector<Vec3>& points) {
  std::vector<Geographic> places;
  places.reserve(points.size());
  for (const Vec3& p : points) places.push_back(place_of(job.rect, p));
  std::vector<double> heights(places.size());
  job.field.filled(places, heights);
  const double most = job.level.fit_error_m / 2;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double& z = points[i].z;
    z = std::isnan(z) ? heights[i] : std::clamp(z, heights[i] - most, heights[i] + most);
  }
}

/// From a to b, on the grid, ends included.
std::vector<Vec3> places_along(const Vec3& a, const Vec3& b, double step, bool own_heights) {
  const int parts = std::min(kMostPlaces, int(std::hypot(b.x - a.x, b.y - a.y) / step));
  std::vector<Vec3> places = {a};
  for (int k = 1; k < parts; ++k) {
    const Vec3 p = a + (b - a) * (double(k) / parts);
    places.push_back({std::clamp(std::round(p.x), 1.0, kTileExtent - 1),
                      std::clamp(std::round(p.y), 1.0, kTileExtent - 1),
                      own_heights ? p.z : std::numeric_limits<double>::quiet_NaN()});
  }
  places.push_back(b);
  return places;
}

/// Of places one after the other, the ends apart, those without which the way is too far off.
std::vector<Vec3> needed(const std::vector<Vec3>& places, double error_m) {
  std::vector<bool> stays(places.size(), false);
  mark_needed(0, places.size() - 1, error_m, stays, [&](auto from, auto to, auto i) {
    const double share = double(i - from) / double(to - from);
    return std::abs(places[from].z + share * (places[to].z - places[from].z) - places[i].z);
  });
  std::vector<Vec3> kept;
  for (std::size_t k = 1; k + 1 < places.size(); ++k)
    if (stays[k]) kept.push_back(places[k]);
  return kept;
}

}  // namespace

void give_heights(const TileJob& job, TileLine& line) {
  std::vector<bool> own;
  own.reserve(line.points.size());
  for (const Vec3& p : line.points) own.push_back(!std::isnan(p.z));
  give_heights(job, line.points);
  if (!(job.line_error_m > 0)) return;
  const double unit_m = tiling::tile_degrees(job.id.level) * kMetresPerDegree / kTileExtent;
  const double step = std::max(kLeastStep, job.spacing_m() / unit_m);
  std::vector<Vec3> followed = {line.points.front()};
  for (std::size_t i = 1; i < line.points.size(); ++i) {
    const Vec3 &a = line.points[i - 1], &b = line.points[i];
    std::vector<Vec3> places = places_along(a, b, step, own[i - 1] && own[i]);
    give_heights(job, places);
    places.front() = a, places.back() = b;
    const std::vector<Vec3> more = needed(places, job.line_error_m);
    followed.insert(followed.end(), more.begin(), more.end());
    followed.push_back(b);
  }
  line.points = std::move(followed);
}

}  // namespace tind
