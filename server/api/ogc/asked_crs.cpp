#include "server/api/ogc/asked_crs.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "terrain/geo/geodesic_path.h"
#include "terrain/geo/longitude.h"
#include "terrain/geo/web_mercator.h"
#include "terrain/raster/dem_window.h"

namespace tind::api::ogc {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool on_earth(const Geographic& p) { return std::abs(p.lon) <= 540 && std::abs(p.lat) <= 90; }

double turn_of(const std::string& name, const CrsPoints& system) {
  if (name == "EPSG:3857") return web_mercator::kEarthM;
  if (!system.geographic()) return 0;
  const Geographic degree[] = {{0, 0}, {1, 0}};  // in degrees or in grads
  Vec2 points[2];
  system.from_geographic(degree, points);
  if (!system.east_first())
    for (Vec2& p : points) std::swap(p.x, p.y);
  return points[1].x - points[0].x > 1.05 ? 400 : 360;
}

bool contains(const CrsBox& box, Vec2 p) {
  return p.x >= box.west && p.x <= box.east && p.y >= box.south && p.y <= box.north;
}

/// Whether it holds the pole of a sign. (Of degrees no box does: the rim is the pole then.)
bool holds_pole(const CrsBox& box, const AskedCrs& crs, int sign) {
  if (crs.turn() > 0) return false;
  const Geographic pole[] = {{0, sign * 90.}};
  Vec2 point;
  crs.from_geographic(pole, {&point, 1});
  return std::isfinite(point.x) && std::isfinite(point.y) && contains(box, point);
}

/// Places on its rim whose longitudes go on across the antimeridian.
std::vector<Geographic> rim_of(const CrsBox& box, const AskedCrs& crs) {
  std::vector<Vec2> points = {{(box.west + box.east) / 2, (box.south + box.north) / 2}};
  for (const Geographic& p : outline_of({box.west, box.south, box.east, box.north}))
    points.push_back({p.lon, p.lat});
  auto where = crs.to_geographic(points);
  const double middle = where[0].lon;
  for (std::size_t i = 0; i < where.size(); ++i)
    where[i].lon =
        nearest_turn(where[i].lon, crs.turn() > 0 ? points[i].x * 360 / crs.turn() : middle, 360);
  where.erase(where.begin());
  std::erase_if(where, [](const Geographic& p) { return std::isnan(p.lon); });
  return where;
}

/// Around places whose longitudes go on; nothing where there are none in it.
std::optional<CrsBox> box_around(const AskedCrs& crs, std::vector<Geographic> places) {
  crs.keep_on_map(places);
  std::vector<Vec2> points(places.size());
  crs.from_geographic(places, points);
  const double turn = crs.turn();
  CrsBox box{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vec2 p = points[i];
    if (turn > 0) p.x = nearest_turn(p.x, places[i].lon * turn / 360, turn);
    if (std::isfinite(p.x) && std::isfinite(p.y))
      box = {std::min(box.west, p.x), std::min(box.south, p.y), std::max(box.east, p.x),
             std::max(box.north, p.y)};
  }
  if (!(box.west < box.east) || !(box.south < box.north)) return {};
  if (turn > 0 && box.west < -turn / 2 * (1 + 1e-9)) box.west += turn, box.east += turn;
  return box;
}

}  // namespace

Result<AskedCrs> AskedCrs::make(const std::string& name, const DatasetFacts& facts) {
  AskedCrs made;
  made.name_ = name;
  if (name == "CRS84") return made;
  const GeoRect& b = facts.box;
  auto system =
      CrsPoints::make(name, within_first_turn({(b.west + b.east) / 2, (b.south + b.north) / 2}));
  if (!system) return std::unexpected(system.error());
  made.turn_ = turn_of(name, **system);
  made.system_ = std::move(*system);
  return made;
}

std::string AskedCrs::wkt() const {
  if (system_) return system_->wkt();
  const auto same = CrsPoints::make("EPSG:4326", {});
  return same ? (*same)->wkt() : std::string();
}

void AskedCrs::to_geographic(std::span<const Vec2> points, std::span<Geographic> out) const {
  if (!system_) {
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = {points[i].x, points[i].y};
  } else {
    std::vector<Vec2> written(points.begin(), points.end());
    if (!east_first())
      for (Vec2& p : written) std::swap(p.x, p.y);
    system_->to_geographic(written, out);
  }
  for (Geographic& p : out)
    if (!on_earth(p)) p = {kNaN, kNaN};
}

std::vector<Geographic> AskedCrs::to_geographic(std::span<const Vec2> points) const {
  std::vector<Geographic> out(points.size());
  to_geographic(points, out);
  return out;
}

void AskedCrs::from_geographic(std::span<const Geographic> places, std::span<Vec2> out) const {
  if (!system_) {
    for (std::size_t i = 0; i < places.size(); ++i) out[i] = {places[i].lon, places[i].lat};
    return;
  }
  system_->from_geographic(places, out);
  if (!east_first())
    for (Vec2& p : out) std::swap(p.x, p.y);
}

void AskedCrs::keep_on_map(std::span<Geographic> places) const {
  if (name_ != "EPSG:3857") return;
  const GeoRect map = web_mercator::rect({0, 0, 0});
  for (Geographic& p : places) p.lat = std::clamp(p.lat, map.south, map.north);
}

Vec2 AskedCrs::point(std::array<double, 2> p) const {
  return east_first() ? Vec2{p[0], p[1]} : Vec2{p[1], p[0]};
}

Result<CrsBox> AskedCrs::box(std::array<double, 4> b) const {
  const Vec2 low = point({b[0], b[1]}), high = point({b[2], b[3]});
  CrsBox box{low.x, low.y, high.x, high.y};
  const bool degrees = geographic();
  if (degrees && box.west > box.east) box.east += turn_;
  if (!(box.west < box.east) || !(box.south < box.north))
    return fail(Errc::invalid_argument,
                "must be the least of both axes, then the most, in the order of the axes of " +
                    name_ + (east_first() ? " (east first)" : " (north first)"));
  if (!is_on_globe(box))
    return fail(Errc::invalid_argument, std::string("must be longitudes and latitudes, ") +
                                            (turn_ == 400 ? "grads" : "degrees"));
  return box;
}

bool AskedCrs::is_on_globe(const CrsBox& box) const {
  return !geographic() || (box.west >= -turn_ && box.east <= 1.5 * turn_ && box.width() <= turn_ &&
                           box.south >= -turn_ / 4 && box.north <= turn_ / 4);
}

Vec2 ground_m(const AskedCrs& crs, const CrsBox& box) {
  constexpr double kShare = 1. / 1024;  // short enough to be straight
  const double x = (box.west + box.east) / 2, y = (box.south + box.north) / 2;
  const double dx = box.width() * kShare, dy = box.height() * kShare;
  const std::vector<Vec2> points = {{x, y}, {x + dx, y}, {x, y + dy}};
  const auto at = crs.to_geographic(points);
  for (const Geographic& p : at)
    if (std::isnan(p.lon) || std::isnan(p.lat)) return {};
  const auto apart = [](const Geographic& a, const Geographic& b) {
    const std::array ends = {a, b};
    return GeodesicPath(ends).length_m();
  };
  return {apart(at[0], at[1]) / kShare, apart(at[0], at[2]) / kShare};
}

std::optional<CrsBox> box_in(const CrsBox& box, const AskedCrs& from, const AskedCrs& to) {
  if (from.name() == to.name()) return box;
  auto around = box_around(to, rim_of(box, from));
  for (const int sign : {1, -1}) {
    if (!around || !to.geographic() || !holds_pole(box, from, sign)) continue;
    around->west = -to.turn() / 2, around->east = to.turn() / 2;
    (sign > 0 ? around->north : around->south) = sign * to.turn() / 4;
  }
  return around;
}

Result<CrsBox> box_of(const AskedCrs& crs, const DatasetFacts& facts) {
  const GeoRect& b = facts.box;
  if (crs.name() == "CRS84") return CrsBox{b.west, b.south, b.east, b.north};
  if (const auto box = box_around(crs, outline_of(b))) return *box;
  return fail(Errc::invalid_argument, crs.name() + " has no places where this dataset lies");
}

std::optional<std::array<double, 4>> four_numbers(std::string_view text) {
  std::vector<double> all;
  while (all.size() < 7) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || !std::isfinite(value)) return {};
    all.push_back(value);
    text.remove_prefix(std::size_t(end - text.data()));
    if (text.empty()) break;
    if (!text.starts_with(',')) return {};
    text.remove_prefix(1);
  }
  if (!text.empty()) return {};
  if (all.size() == 4) return std::array{all[0], all[1], all[2], all[3]};
  if (all.size() == 6) return std::array{all[0], all[1], all[3], all[4]};
  return {};
}

}  // namespace tind::api::ogc
