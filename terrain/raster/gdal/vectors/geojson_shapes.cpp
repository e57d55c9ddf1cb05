// Every corner is transformed by PROJ's operation for this DEM, and its longitude taken in the turn
// that is nearest to the corner before: then nothing jumps, a line over the antimeridian goes on,
// and a ring that does not come back to where it began is around a pole.

#include "terrain/raster/gdal/vectors/geojson_shapes.h"

#include <ogr_geometry.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "terrain/geo/ellipsoid.h"
#include "terrain/geo/longitude.h"
#include "terrain/raster/gdal/vectors/antimeridian_cut.h"

namespace tind::gdal {

struct GeojsonShapes::Place {
  Vec2 crs, globe;
  double z = 0;
};

struct GeojsonShapes::Path {
  std::vector<Place> places;
  bool divided = false;  // there are more than the curve has
};

namespace {

/// Straight sides in a projection are none in longitude and latitude: their sagitta is at most
/// L^2 tan(lat) / 8 R, which for so long a one is a millimetre at 45 degrees.
constexpr double kLongestSide_m = 200;
/// Where that is more, as near the poles, areas get more corners.
constexpr double kAreaOff_m = 0.01;
constexpr int kDeepest = 24;  // halvings of a side
/// A metre from the pole: at a pole itself, and opposite to one, PROJ may have no result or a
/// wrong one.
constexpr double kBesidePole = 90 - 1e-5;
constexpr double kPoint_m = 100;  // a pole whose surroundings are no farther apart is a point

/// About how far the side in the plane is from the one in longitude and latitude, metres, where
/// meridians lead to a point: the sagitta, and what they come nearer to each other along the side.
double bulge_m(Vec2 a, Vec2 b) {
  constexpr double kDegree = std::numbers::pi / 180;
  const double lat = std::min(std::abs(a.y), std::abs(b.y)) * kDegree;
  const double turn = std::abs(b.x - a.x) * kDegree, climb = std::abs(b.y - a.y) * kDegree;
  return wgs84::kSemiMajor * turn * std::sin(lat) * (turn * std::cos(lat) / 8 + climb / 4);
}

/// On the antimeridian exactly, where it is but for PROJ's rounding: else a piece as wide as that
/// lies on its other side.
double without_noise(double lon) {
  constexpr double kNoise = 5e-10;  // degrees, half of the last decimal
  const double antimeridian = nearest_turn(180, lon, 360);
  return std::abs(lon - antimeridian) < kNoise ? antimeridian : lon;
}

/// PROJ has NaN for what is beyond a CRS, or the globe.
bool is_place(Vec2 p) { return std::isfinite(p.x) && std::isfinite(p.y); }

/// In one piece and in its turn, so that nothing is to be cut.
bool is_whole(const GlobeRing& ring) {
  return ring.pole == 0 &&
         std::ranges::all_of(ring.points, [](Vec2 p) { return std::abs(p.x) <= 180; });
}

bool holds(const OGRLinearRing& ring, Vec2 place) {
  const OGRPoint point(place.x, place.y);
  return is_place(place) && ring.isPointInRing(&point);
}

OGRPolygon polygon_of(const std::vector<GlobeRing>& rings) {
  OGRPolygon polygon;
  for (const GlobeRing& from : rings) {
    auto ring = std::make_unique<OGRLinearRing>();
    for (const Vec2& p : from.points) ring->addPoint(p.x, p.y);
    polygon.addRingDirectly(ring.release());
  }
  return polygon;
}

}  // namespace

Result<GeojsonShapes> GeojsonShapes::make(const DemInfo& info) {
  const auto crs = crs_of_layer(info.crs_wkt);
  if (!crs) return std::unexpected(crs.error());
  const auto facts = describe(&*crs);
  if (!facts) return std::unexpected(facts.error());
  GeojsonShapes shapes;
  if (facts->plain_wgs84) return shapes;
  const Affine& posts = info.post_to_crs;
  auto way =
      ToGeographic::make(info.crs_wkt, posts.apply(double(info.cols) / 2, double(info.rows) / 2));
  if (!way) return std::unexpected(way.error());
  shapes.way_ = std::move(*way);
  shapes.projected_ = info.crs_kind == CrsKind::projected;
  if (!shapes.projected_) return shapes;
  shapes.line_off_m_ = std::max(kAreaOff_m, std::min(info.spacing_x_m, info.spacing_y_m) / 100);
  shapes.longest_side_ = kLongestSide_m * std::hypot(posts.x_col, posts.y_col) / info.spacing_x_m;
  shapes.poles_[0] = {0, kBesidePole}, shapes.poles_[1] = {0, -kBesidePole};
  shapes.way_->to_crs(shapes.poles_);
  // Where a pole is a line, nothing goes around it.
  Vec2 beside[2] = {{90, kBesidePole}, {90, -kBesidePole}};
  shapes.way_->to_crs(beside);
  for (int i = 0; i < 2; ++i) {
    const double apart =
        std::hypot(shapes.poles_[i].x - beside[i].x, shapes.poles_[i].y - beside[i].y);
    if (!(apart * info.crs_unit_m < kPoint_m)) shapes.poles_[i] = {NAN, NAN};
  }
  return shapes;
}

GeojsonShapes::Place GeojsonShapes::place(Vec2 crs, Vec2 globe, double z, const Place* last) const {
  if (!way_) return {crs, crs, z};
  const double lon = last ? nearest_turn(globe.x, last->globe.x, 360) : globe.x;
  return {crs, {without_noise(lon), globe.y}, z};
}

void GeojsonShapes::divide(const Place& from, const Place& to, double most_off_m, int depth,
                           Path& path) const {
  if (depth == 0 || !(bulge_m(from.globe, to.globe) > most_off_m)) return;
  const Vec2 middle{(from.crs.x + to.crs.x) / 2, (from.crs.y + to.crs.y) / 2};
  Vec2 globe = middle;
  way_->to_geographic({&globe, 1});
  if (!is_place(globe)) return;
  const Place between = place(middle, globe, (from.z + to.z) / 2, &from);
  Place end = to;  // by the way past the middle it may be in another turn
  end.globe.x = nearest_turn(to.globe.x, between.globe.x, 360);
  divide(from, between, most_off_m, depth - 1, path);
  path.places.push_back(between);
  divide(between, end, most_off_m, depth - 1, path);
  path.divided = true;
}

GeojsonShapes::Paths GeojsonShapes::paths(const OGRSimpleCurve& curve, double most_off_m) const {
  std::vector<Vec2> crs;
  for (int i = 0; i < curve.getNumPoints(); ++i) crs.push_back({curve.getX(i), curve.getY(i)});
  std::vector<Vec2> globe = crs;
  if (way_) way_->to_geographic(globe);
  Paths found;
  std::vector<Path>& paths = found.parts;
  paths.emplace_back();
  for (std::size_t i = 0; i < crs.size(); ++i) {
    const double z = curve.getZ(int(i));
    if (!is_place(globe[i])) {
      found.whole = false;
      if (!paths.back().places.empty()) paths.emplace_back();
      continue;
    }
    Path& path = paths.back();
    const bool first = path.places.empty();
    const auto next = [&] {
      return place(crs[i], globe[i], z, first ? nullptr : &path.places.back());
    };
    if (!first && projected_) {
      const Place last = path.places.back();
      divide(last, next(), most_off_m, kDeepest, path);
    }
    path.places.push_back(next());
  }
  return found;
}

/// Of a ring that is around one: that which it holds in the plane. Where rounding says both or
/// none, the nearer one.
double GeojsonShapes::pole_in(const OGRLinearRing& ring, const Path& path) const {
  const bool north = holds(ring, poles_[0]), south = holds(ring, poles_[1]);
  if (north != south) return north ? 90 : -90;
  const auto nearest = std::ranges::max_element(
      path.places, {}, [](const Place& place) { return std::abs(place.globe.y); });
  return std::copysign(90, nearest->globe.y);
}

Result<std::unique_ptr<OGRGeometry>> GeojsonShapes::line(const OGRLineString& line) const {
  const Paths found = paths(line, line_off_m_);
  auto lines = std::make_unique<OGRMultiLineString>();
  for (const Path& path : found.parts) {
    std::vector<LinePoint> points;
    for (const Place& p : path.places) points.push_back({{p.globe.x, p.globe.y}, p.z});
    auto cut = cut_line(points);
    if (found.whole) return cut;
    // What has no longitude and latitude is left out: there the line ends, and begins again.
    if (const auto* const many = dynamic_cast<const OGRMultiLineString*>(cut.get()))
      for (const OGRLineString* one : *many) lines->addGeometry(one);
    else if (points.size() > 1)
      lines->addGeometryDirectly(cut.release());
  }
  return lines;
}

Result<std::unique_ptr<OGRGeometry>> GeojsonShapes::area(const OGRPolygon& polygon) const {
  const OGRLinearRing& around = *polygon.getExteriorRing();
  if (projected_ && holds(around, poles_[0]) && holds(around, poles_[1]))
    return fail(Errc::bad_data, "an area around both poles has no rim in longitude and latitude");
  const std::unique_ptr<OGRPolygon> sides(polygon.clone());
  if (projected_) sides->segmentize(longest_side_);
  std::vector<GlobeRing> rings;
  bool divided = false;
  for (const OGRLinearRing* ring : *sides) {
    const Paths found = paths(*ring, kAreaOff_m);
    if (!found.whole) return fail(Errc::bad_data, "some of it has no longitude and latitude");
    const Path& path = found.parts[0];
    GlobeRing& made = rings.emplace_back();
    for (const Place& p : path.places) made.points.push_back(p.globe);
    if (std::abs(made.points.back().x - made.points.front().x) > 180)
      made.pole = pole_in(*ring, path);
    divided = divided || path.divided;
  }
  if (std::ranges::all_of(rings, is_whole) && !divided)
    return std::make_unique<OGRPolygon>(polygon_of(rings));
  auto cut = std::ranges::all_of(rings, is_whole) ? valid_area(polygon_of(rings)) : cut_area(rings);
  if (!cut) return fail(Errc::bad_data, "an area cannot be cut at the antimeridian");
  return cut;
}

}  // namespace tind::gdal
