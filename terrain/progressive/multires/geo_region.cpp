// Points are brought to post coordinates, between which lines are straight. Longitudes say a place,
// but not which turn around the earth it is in: a region is kept whole, and the whole of it goes to
// the turn in which the DEM lies. A box is first cut to the DEM's surroundings, since a projection
// knows nothing of the far side of the earth.

#include "terrain/progressive/multires/geo_region.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

namespace tind {

GeoRegion GeoRegion::box(const GeoRect& r) {
  GeoRegion out;
  out.bounds = r;
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

namespace {

constexpr const char* kOutside = "the region lies outside the DEM";

/// Is any of it over the DEM's rectangle of posts?
bool meets(const Region& region, const DemInfo& info, std::int64_t col, std::int64_t row) {
  const double west = -double(col), north = double(row);
  const double east = west + double(info.cols - 1), south = north - double(info.rows - 1);
  const Vec3 nw{west, north, 0}, ne{east, north, 0}, se{east, south, 0}, sw{west, south, 0};
  return region.touches(sw, se, ne) || region.touches(sw, ne, nw);
}

double overlap(double low, double high, double other_low, double other_high) {
  return std::min(high, other_high) - std::max(low, other_low);
}

/// By how many turns low .. high must go to meet `at` .. `to` best. Nothing: it meets that at both
/// of its ends, from either side of the earth.
std::optional<double> turns_to(double low, double high, double at, double to, double turn) {
  const double near = std::round(((at + to) - (low + high)) / 2 / turn);
  double best = near, most = -HUGE_VAL;
  int parts = 0;
  for (const double turns : {near, near - 1, near + 1}) {
    const double common = overlap(low + turns * turn, high + turns * turn, at, to);
    parts += common > 1e-6 * turn;
    if (common > most) most = common, best = turns;
  }
  return parts > 1 ? std::nullopt : std::optional(best);
}

/// The DEM's extents in one piece, around the longitude of its middle.
GeoRect whole_extent(const DemSource& dem) {
  const DemInfo& info = dem.info();
  const Vec2 posts[] = {{double(info.cols - 1) / 2, double(info.rows - 1) / 2}, {0, 0}};
  Geographic places[2];
  dem.to_geographic(posts, places);
  const GeoRect& b = info.bounds;
  if (info.wraps_longitude) {
    const double west = places[1].lon - (info.post_to_crs.x_col < 0 ? 360 : 0);
    return {west, b.south, west + 360, b.north};
  }
  const double middle = std::isfinite(places[0].lon) ? places[0].lon : (b.west + b.east) / 2;
  GeoRect out{HUGE_VAL, b.south, -HUGE_VAL, b.north};
  const std::span<const GeoRect> parts =
      info.extents.empty() ? std::span(&b, 1) : std::span(info.extents);
  for (const GeoRect& part : parts) {
    const double shift = 360 * std::round((middle - (part.west + part.east) / 2) / 360);
    out.west = std::min(out.west, part.west + shift);
    out.east = std::max(out.east, part.east + shift);
  }
  return out;
}

std::unexpected<Error> in_two_parts(const DemInfo& info) {
  return fail(Errc::invalid_argument,
              info.wraps_longitude
                  ? "the region goes across the place where the DEM's columns begin again: ask for "
                    "what lies on either side of it"
                  : "the region goes around the earth and has both ends on the DEM: ask for one "
                    "after the other (across the antimeridian longitudes count on, 179 to 181)");
}

/// The part of the box that can matter, in the DEM's turn.
Result<GeoRegion> cut_to(const DemSource& dem, GeoRect box) {
  const GeoRect dem_box = whole_extent(dem);
  const bool around = dem.info().wraps_longitude;
  const double x = around ? 0 : 0.1 * dem_box.width() + 1e-3, y = 0.1 * dem_box.height() + 1e-3;
  if (box.width() >= 360) {
    box.west = dem_box.west - x, box.east = dem_box.east + x;
  } else {
    const auto turns = turns_to(box.west, box.east, dem_box.west, dem_box.east, 360);
    if (!turns) return in_two_parts(dem.info());
    box.west = std::max(box.west + 360 * *turns, dem_box.west - x);
    box.east = std::min(box.east + 360 * *turns, dem_box.east + x);
  }
  box.south = std::max(box.south, dem_box.south - y);
  box.north = std::min(box.north, dem_box.north + y);
  if (!(box.west < box.east && box.south < box.north))
    return fail(Errc::invalid_argument, kOutside);
  return GeoRegion::box(box);
}

/// Posts of places that follow each other, all in one turn: the one in which the DEM's columns are.
/// `count_on`: longitudes are as far apart as they say; else the shorter way around is meant.
Result<void> bring_to_one_turn(std::span<const Geographic> places, bool count_on,
                               const DemInfo& info, std::span<Vec2> posts) {
  const double turn = info.period_cols;
  if (!(turn > 0)) return {};
  const double per_degree = std::copysign(turn / 360, info.post_to_crs.x_col);
  double low = posts[0].x, high = low;
  for (std::size_t i = 1; i < posts.size(); ++i) {
    double step = places[i].lon - places[i - 1].lon;
    if (!count_on && std::abs(step) > 180) step = std::remainder(step, 360);
    const double expected = posts[i - 1].x + step * per_degree;
    posts[i].x += turn * std::round((expected - posts[i].x) / turn);
    low = std::min(low, posts[i].x), high = std::max(high, posts[i].x);
  }
  const auto turns = turns_to(low, high, 0, double(info.cols - 1), turn);
  const double first = turns ? low + *turns * turn : 0, last = turns ? high + *turns * turn : 0;
  // Where columns go around, posts beyond the last are again the first, which the mesh has not.
  const double hair = 1e-6 * turn;
  const bool across = info.wraps_longitude && (first < -hair || last > turn + hair);
  if (!turns || across) return in_two_parts(info);
  for (Vec2& p : posts) p.x += *turns * turn;
  return {};
}

}  // namespace

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
  if (bounds && !(bounds->west < bounds->east && bounds->south < bounds->north))
    return fail(Errc::invalid_argument,
                "the box is WEST,SOUTH,EAST,NORTH, and its west or south is not below the other "
                "side; across the antimeridian longitudes count on, as in 179,-20,181,-10");
  Result<GeoRegion> part = bounds ? cut_to(dem, *bounds) : Result<GeoRegion>(*this);
  if (!part) return std::unexpected(part.error());
  std::vector<Vec2> posts(part->points.size());
  dem.to_post(part->points, posts);
  for (const Vec2& p : posts)
    if (!(std::isfinite(p.x) && std::isfinite(p.y)))
      return fail(Errc::invalid_argument,
                  "a point of the region has no place in the DEM's coordinate system");
  if (auto one = bring_to_one_turn(part->points, closed, dem.info(), posts); !one)
    return std::unexpected(one.error());
  for (Vec2& p : posts) p = {p.x - double(col), -(p.y - double(row))};
  Region out =
      closed ? Region::polygon(std::move(posts))
             : Region::corridor(posts, width_m / 2, dem.info().spacing_x_m, dem.info().spacing_y_m);
  if (!meets(out, dem.info(), col, row)) return fail(Errc::invalid_argument, kOutside);
  return out;
}

}  // namespace tind
