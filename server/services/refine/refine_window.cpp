#include "server/services/refine/refine_window.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "terrain/geo/ellipsoid.h"
#include "terrain/surface/tile_posts.h"

namespace tind::services {
namespace {

constexpr std::int64_t kStep = 64;  // posts

}  // namespace

Result<RefineWindow> refine_window(const DemSource& dem, const std::optional<GeoRect>& asked,
                                   std::size_t most) {
  const DemInfo& info = dem.info();
  if (!asked) {
    if (std::size_t(info.cols) * std::size_t(info.rows) > most)
      return fail(Errc::invalid_argument,
                  fmt::format("this dataset has {} x {} posts; at most {} in all can be refined at "
                              "a time: ask for a window, [west, south, east, north]",
                              info.cols, info.rows, most));
    return RefineWindow{0, 0, int(info.cols), int(info.rows)};
  }
  const PostWindow posts = post_window(dem, *asked);
  if (posts.cols < 2 || posts.rows < 2)
    return fail(Errc::invalid_argument, "the window holds no posts of this dataset");
  if (posts.col < 0 || posts.col + posts.cols > info.cols)
    return fail(Errc::unsupported,
                "the window lies across the seam of a DEM that goes around the globe");
  const std::int64_t left = posts.col / kStep * kStep, top = posts.row / kStep * kStep;
  const std::int64_t right =
      std::min(info.cols, (posts.col + posts.cols + kStep - 1) / kStep * kStep);
  const std::int64_t bottom =
      std::min(info.rows, (posts.row + posts.rows + kStep - 1) / kStep * kStep);
  const std::int64_t cols = right - left, rows = bottom - top;
  if (std::size_t(cols) * std::size_t(rows) > most)
    return fail(Errc::invalid_argument,
                fmt::format("the window holds {} x {} posts; at most {} in all can be refined at a "
                            "time",
                            cols, rows, most));
  return RefineWindow{left, top, int(cols), int(rows)};
}

GeoRect around(const GeoRegion& region) {
  GeoRect box{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const Geographic& p : region.points) {
    const Vec2 degree = wgs84::metres_per_degree(std::clamp(p.lat, -89.0, 89.0));
    const double lon = region.width_m / 2 / degree.x, lat = region.width_m / 2 / degree.y;
    box = {std::min(box.west, p.lon - lon), std::min(box.south, p.lat - lat),
           std::max(box.east, p.lon + lon), std::max(box.north, p.lat + lat)};
  }
  const double x = box.width() / 10, y = box.height() / 10;
  return {box.west - x, box.south - y, box.east + x, box.north + y};
}

}  // namespace tind::services
