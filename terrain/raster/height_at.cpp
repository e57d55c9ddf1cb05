// A place is brought to post coordinates; the 2 x 2 posts around it are read and interpolated.

#include <cmath>

#include "terrain/raster/dem_source.h"
#include "terrain/raster/interpolate.h"
#include "terrain/raster/post_place.h"

namespace tind {

Result<HeightAt> height_at(const DemSource& source, Geographic place) {
  const DemInfo& info = source.info();
  if (info.crs_kind == CrsKind::none)
    return fail(Errc::invalid_argument,
                info.files[0] + ": has no CRS, so it has no heights at longitudes and latitudes");
  Vec2 post;
  source.to_post({&place, 1}, {&post, 1});
  const auto at = place_among_posts(info, post);
  if (!at) return HeightAt{};
  const double col = std::floor(at->x), row = std::floor(at->y);
  auto grid = source.read(std::int64_t(col), std::int64_t(row), 2, 2);
  if (!grid) return std::unexpected(grid.error());
  const double z = height_between(grid->at(0, 0), grid->at(1, 0), grid->at(0, 1), grid->at(1, 1),
                                  at->x - col, at->y - row);
  if (std::isnan(z)) return HeightAt{Coverage::void_, 0};
  return HeightAt{Coverage::value, z};
}

}  // namespace tind
