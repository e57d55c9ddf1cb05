// A place is brought to post coordinates; the 2 x 2 posts around it are read and interpolated.

#include <cmath>

#include "terrain/raster/dem_source.h"
#include "terrain/raster/interpolate.h"

namespace tind {
namespace {

/// A place this near to a post (in posts) is at the post: PROJ there and back is not exact.
constexpr double kAtPost = 1e-6;

double snapped(double x) { return std::abs(x - std::round(x)) <= kAtPost ? std::round(x) : x; }

}  // namespace

Result<HeightAt> height_at(const DemSource& source, Geographic place) {
  const DemInfo& info = source.info();
  if (info.crs_kind == CrsKind::none)
    return fail(Errc::invalid_argument,
                info.files[0] + ": has no CRS, so it has no heights at longitudes and latitudes");
  Vec2 post;
  source.to_post({&place, 1}, {&post, 1});
  const double x = snapped(post.x), y = snapped(post.y);
  const bool in_cols = info.wraps_longitude || (x >= 0 && x <= double(info.cols - 1));
  if (!in_cols || !(y >= 0 && y <= double(info.rows - 1)) || !std::isfinite(x)) return HeightAt{};
  const double col = std::floor(x), row = std::floor(y);
  auto grid = source.read(std::int64_t(col), std::int64_t(row), 2, 2);
  if (!grid) return std::unexpected(grid.error());
  const double z = height_between(grid->at(0, 0), grid->at(1, 0), grid->at(0, 1), grid->at(1, 1),
                                  x - col, y - row);
  if (std::isnan(z)) return HeightAt{Coverage::void_, 0};
  return HeightAt{Coverage::value, z};
}

}  // namespace tind
