// Points are brought to post coordinates one by one; between them, lines are straight among posts.

#include "terrain/progressive/geo_region.h"

#include <cmath>

namespace tind {

GeoRegion GeoRegion::box(const GeoRect& r) {
  GeoRegion out;
  const Geographic corner[] = {{r.west, r.south},
                               {r.east, r.south},
                               {r.east, r.north},
                               {r.west, r.north},
                               {r.west, r.south}};
  for (int side = 0; side < 4; ++side)
    for (int k = 0; k < 16; ++k) {
      const Geographic a = corner[side], b = corner[side + 1];
      out.points.push_back({a.lon + (b.lon - a.lon) * k / 16, a.lat + (b.lat - a.lat) * k / 16});
    }
  return out;
}

Result<Region> GeoRegion::over(const DemSource& dem, std::int64_t col, std::int64_t row) const {
  if (dem.info().crs_kind == CrsKind::none)
    return fail(Errc::unsupported, "the DEM has no coordinate system: a region has no place in it");
  if (points.size() < (closed ? 3 : 2))
    return fail(Errc::invalid_argument,
                closed ? "a polygon needs three points" : "a route needs two points");
  if (!closed && !(width_m > 0 && std::isfinite(width_m)))
    return fail(Errc::invalid_argument, "a corridor needs a width above 0 metres");
  for (const Geographic& p : points)
    if (!(std::abs(p.lon) <= 360 && std::abs(p.lat) <= 90))
      return fail(Errc::invalid_argument,
                  "a point of the region is no longitude and latitude in degrees");
  std::vector<Vec2> posts(points.size());
  dem.to_post(points, posts);
  for (Vec2& p : posts) {
    if (!(std::isfinite(p.x) && std::isfinite(p.y)))
      return fail(Errc::invalid_argument,
                  "a point of the region has no place in the DEM's coordinate system");
    p = {p.x - double(col), -(p.y - double(row))};
  }
  if (closed) return Region::polygon(std::move(posts));
  return Region::corridor(std::move(posts), width_m / 2, dem.info().spacing_x_m,
                          dem.info().spacing_y_m);
}

}  // namespace tind
