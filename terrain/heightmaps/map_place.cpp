// The area's four sides are drawn in the crs, where they are curves: the smallest rectangle around
// them covers it, the one between them lies inside.

#include "terrain/heightmaps/map_place.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "terrain/geo/ellipsoid.h"
#include "terrain/geo/extent_box.h"
#include "terrain/raster/crs_axes.h"
#include "terrain/raster/crs_code.h"

namespace tind {
namespace {

constexpr int kUnrealSizes[] = {127, 253, 505, 1009, 2017, 4033, 8129};  // as Epic recommends
constexpr int kUnitySizes[] = {33, 65, 129, 257, 513, 1025, 2049, 4097};
constexpr int kOutline = 64;  // pieces of a side

std::span<const int> good_sizes(Engine engine) {
  return engine == Engine::unreal ? std::span<const int>(kUnrealSizes) : kUnitySizes;
}

/// The sides, each from one corner to the next.
struct Outline {
  std::vector<Geographic> north, east, south, west;
};

template <class Place>
Outline outline_of(const Place& place) {
  Outline o;
  for (int i = 0; i <= kOutline; ++i) {
    const double t = double(i) / kOutline;
    o.north.push_back(place(t, 0)), o.south.push_back(place(t, 1));
    o.west.push_back(place(0, t)), o.east.push_back(place(1, t));
  }
  return o;
}

Outline outline_of(const GeoRect& r) {
  return outline_of([&](double x, double y) {
    return Geographic{r.west + x * r.width(), r.north - y * r.height()};
  });
}

/// Around all layers, the shorter way around the earth.
GeoRect box_of(const Surface& surface) {
  std::vector<GeoRect> all;
  for (const SurfaceLayer& layer : surface.layers()) {
    const DemInfo& info = layer.source->info();
    if (info.extents.empty()) all.push_back(info.bounds);
    all.insert(all.end(), info.extents.begin(), info.extents.end());
  }
  return box_around(all);
}

/// Of the posts themselves, which are turned against lines of longitude where the DEM is projected.
Result<Outline> outline_of(const Surface& surface, const std::optional<GeoRect>& area) {
  const DemSource* const dem = surface.only();
  if (area || !dem) return outline_of(area ? *area : box_of(surface));
  if (dem->info().wraps_longitude) return outline_of(surface.info().bounds);
  const DemInfo& info = dem->info();
  const auto axes = crs_axes(info.crs_wkt);
  if (!axes) return std::unexpected(axes.error());
  // North and west as the rows and columns have it, whichever way round those are, and the axes.
  const Affine map = axes->east_north(info.post_to_crs);
  const bool cols_go_north = std::abs(map.y_col) > std::abs(map.x_col);
  const auto share = [](double from_north_west, double step) {
    return step < 0 ? 1 - from_north_west : from_north_west;
  };
  return outline_of([&](double x, double y) {
    const double u = cols_go_north ? share(y, -map.y_col) : share(x, map.x_col);
    const double v = cols_go_north ? share(x, map.x_row) : share(y, -map.y_row);
    const Vec2 post{u * double(info.cols - 1), v * double(info.rows - 1)};
    Geographic place;
    dem->to_geographic({&post, 1}, {&place, 1});
    return place;
  });
}

/// West, south, east, north, metres.
struct Extent {
  double west, south, east, north;
  double width() const { return east - west; }
  double height() const { return north - south; }
};

using Points = std::vector<Vec2>;

/// East and north, metres of the crs; NaN where it has no such place.
Points drawn(const CrsPoints& crs, const std::vector<Geographic>& side) {
  Points points(side.size());
  crs.from_geographic(side, points);
  if (!crs.east_first())
    for (Vec2& p : points) std::swap(p.x, p.y);
  return points;
}

/// NaN where one is.
double least(const Points& points, double Vec2::*of) {
  double v = HUGE_VAL;
  for (const Vec2& p : points) v = p.*of < v || std::isnan(p.*of) ? p.*of : v;
  return v;
}
double most(const Points& points, double Vec2::*of) {
  double v = -HUGE_VAL;
  for (const Vec2& p : points) v = p.*of > v || std::isnan(p.*of) ? p.*of : v;
  return v;
}

Extent extent_of(const CrsPoints& crs, const Outline& o, MapFit fit) {
  const Points north = drawn(crs, o.north), south = drawn(crs, o.south), west = drawn(crs, o.west),
               east = drawn(crs, o.east);
  if (fit == MapFit::inside)
    return {most(west, &Vec2::x), most(south, &Vec2::y), least(east, &Vec2::x),
            least(north, &Vec2::y)};
  Points all = north;
  for (const Points* side : {&south, &west, &east})
    all.insert(all.end(), side->begin(), side->end());
  return {least(all, &Vec2::x), least(all, &Vec2::y), most(all, &Vec2::x), most(all, &Vec2::y)};
}

Result<std::shared_ptr<const CrsPoints>> crs_of(const MapOptions& options, Geographic middle) {
  auto made = options.crs.empty() ? CrsPoints::local(middle) : CrsPoints::make(options.crs, middle);
  if (!made) return std::unexpected(made.error());
  const auto code = crs_code(options.crs);
  if (!code) return std::unexpected(code.error());
  if (code->geographic || code->unit_m != 1)
    return fail(Errc::invalid_argument,
                options.crs + (code->geographic ? " counts degrees" : " does not count metres") +
                    ": an engine's terrain needs square metres");
  return std::shared_ptr<const CrsPoints>(std::move(*made));
}

double finest_m(const Surface& surface) {
  double finest = HUGE_VAL;
  for (const SurfaceLayer& layer : surface.layers()) finest = std::min(finest, layer.finest_m());
  return finest;
}

Geographic middle_of(const Outline& o) {
  // Of the four sides' middles, so that a meridian where longitudes end is no matter.
  const std::size_t half = kOutline / 2;
  Vec3 sum;
  for (const Geographic& p : {o.north[half], o.south[half], o.west[half], o.east[half]})
    sum = sum + wgs84::to_ecef(p, 0) * .25;
  return wgs84::from_ecef(sum).p;
}

Result<void> check(const MapOptions& o) {
  for (const int size : {o.cols, o.rows})
    if (size != 0 && !engine_takes(o.engine, size))
      return fail(Errc::invalid_argument,
                  fmt::format("{} imports no side of {} posts; {}",
                              o.engine == Engine::unreal ? "Unreal" : "Unity", size,
                              engine_sizes(o.engine)));
  if (o.engine == Engine::unity && o.cols != o.rows)
    return fail(Errc::invalid_argument, "terrains of Unity are square: say one size");
  return {};
}

/// The smallest side of at least `posts` (or the largest of at most that many).
int best_size(Engine engine, double posts, MapFit fit) {
  const auto sizes = good_sizes(engine);
  int best = fit == MapFit::cover ? sizes.back() : sizes.front();
  if (fit == MapFit::cover) {
    for (const int size : sizes)
      if (size >= posts - 1e-6) return size;
  } else {
    for (const int size : sizes)
      if (size <= posts + 1e-6) best = size;
  }
  return best;
}

/// A spacing that was asked for, and no side of the engine's with it that is large (or small)
/// enough.
Result<void> check_fit(const MapOptions& o, const Extent& e, const MapPlace& map) {
  if (o.cols > 0 || !o.spacing_m) return {};
  const bool cover = o.fit == MapFit::cover;
  const double side = cover ? std::max(e.width(), e.height()) : std::min(e.width(), e.height());
  const double has = (map.cols - 1) * map.spacing_m;
  if (cover ? has >= side * (1 - 1e-6) : has <= side * (1 + 1e-6)) return {};
  return fail(
      Errc::invalid_argument,
      fmt::format(
          "{} posts, {:.10g} m apart, are the {} there is, and {} the area of {:.6g} m: take a "
          "--spacing of {} {:.6g} m, or another area with --bounds",
          map.cols, map.spacing_m, cover ? "most" : "least",
          cover ? "do not cover" : "do not lie inside", side, cover ? "at least" : "at most",
          side / (map.cols - 1)));
}

void fit_posts(const MapOptions& o, const Extent& e, double finest, MapPlace& map) {
  const bool cover = o.fit == MapFit::cover;
  const double side = cover ? std::max(e.width(), e.height()) : std::min(e.width(), e.height());
  if (o.cols > 0) {
    map.cols = o.cols, map.rows = o.rows;
    const double x = e.width() / (o.cols - 1), y = e.height() / (o.rows - 1);
    map.spacing_m = o.spacing_m.value_or(cover ? std::max(x, y) : std::min(x, y));
  } else if (o.spacing_m) {
    map.cols = map.rows = best_size(o.engine, side / *o.spacing_m + 1, o.fit);
    map.spacing_m = *o.spacing_m;
  } else {  // as fine as the source, whichever way the map fits
    map.cols = map.rows = best_size(o.engine, side / finest + 1, MapFit::cover);
    map.spacing_m = side / (map.cols - 1);
  }
}

double scale_error(const MapPlace& map) {
  double most = 0;
  for (const double u : {0., .5, 1.})
    for (const double v : {0., .5, 1.}) {
      const double col = u * (map.cols - 2), row = v * (map.rows - 2);
      const Vec3 at = wgs84::to_ecef(map.place(col, row), 0);
      for (const Geographic& next : {map.place(col + 1, row), map.place(col, row + 1)})
        most = std::max(most, std::abs(length(wgs84::to_ecef(next, 0) - at) / map.spacing_m - 1));
    }
  return most;
}

constexpr const char* kNoArea =
    "the area has no width or no height, as one post has none: a heightmap needs two columns and "
    "two rows of posts";

/// What to do where the map's own projection, made for a place like any other, is none for the
/// area: around a pole its west and east are not where a polar DEM's are.
std::string other_crs(const MapOptions& options, Geographic middle) {
  if (!options.crs.empty()) return "choose another with --to-crs";
  const std::string near_pole = middle.lat > 60    ? ", as EPSG:3413 around the North Pole"
                                : middle.lat < -60 ? ", as EPSG:3031 around the South Pole"
                                                   : "";
  return "choose the projection with --to-crs" + near_pole;
}

}  // namespace

bool engine_takes(Engine engine, int size) {
  if (engine == Engine::unity) return std::ranges::find(kUnitySizes, size) != std::end(kUnitySizes);
  for (const int quads : {7, 15, 31, 63, 127, 255})
    for (const int sections : {1, 2}) {
      const int component = quads * sections;
      if (size > 1 && (size - 1) % component == 0 && (size - 1) / component <= 32) return true;
    }
  return false;
}

std::string engine_sizes(Engine engine) {
  std::string text;
  for (const int size : good_sizes(engine))
    text += (text.empty() ? "" : ", ") + std::to_string(size);
  return engine == Engine::unreal ? "recommended are " + text +
                                        "; others are n components of 7, 15, 31, 63, 127 or 255 "
                                        "quads (or twice that) and one post more, n at most 32"
                                  : "there are " + text;
}

void MapPlace::places(double row, double first, std::span<Geographic> places) const {
  std::vector<Vec2> points(places.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] = post(first + double(i), row);
    if (!crs->east_first()) std::swap(points[i].x, points[i].y);
  }
  crs->to_geographic(points, places);
}

Geographic MapPlace::place(double col, double row) const {
  Geographic at;
  places(row, col, {&at, 1});
  return at;
}

RasterLattice MapPlace::lattice() const {
  return {cols,
          rows,
          {spacing_m, spacing_m},
          [map = *this](double row, double first, std::span<Geographic> places) {
            map.places(row, first, places);
          }};
}

Result<MapPlace> place_map(const Surface& surface, const MapOptions& options) {
  if (auto ok = check(options); !ok) return std::unexpected(ok.error());
  // By its columns and rows: a parallel is curved, so that one row has a height of a hair on a map.
  if (const DemSource* dem = surface.only();
      dem && std::min(dem->info().cols, dem->info().rows) < 2)
    return fail(Errc::invalid_argument, kNoArea);
  const auto outline = outline_of(surface, options.area);
  if (!outline) return std::unexpected(outline.error());
  const Geographic middle = middle_of(*outline);
  auto crs = crs_of(options, middle);
  if (!crs) return std::unexpected(crs.error());
  MapPlace map;
  map.crs = *crs;
  const Extent e = extent_of(*map.crs, *outline, options.fit);
  const std::string what_else = other_crs(options, middle);
  if (!std::isfinite(e.width()) || !std::isfinite(e.height()))
    return fail(Errc::invalid_argument, map.crs->text() +
                                            " has no places for a part of the area: " + what_else +
                                            ", or a smaller area with --bounds");
  if (!(e.width() > 0 && e.height() > 0))
    return fail(
        Errc::invalid_argument,
        options.fit == MapFit::inside
            ? "no square lies inside the area, as it is turned: take --fit cover, or " + what_else
            : kNoArea);
  map.middle = {(e.west + e.east) / 2, (e.south + e.north) / 2};
  fit_posts(options, e, finest_m(surface), map);
  if (const auto ok = check_fit(options, e, map); !ok) return std::unexpected(ok.error());
  map.scale_error = scale_error(map);
  return map;
}

}  // namespace tind
