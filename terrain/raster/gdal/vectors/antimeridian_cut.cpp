// Areas lie on a map that goes on beyond 180 degrees; GEOS says what of them lies in each turn, and
// the turns are laid on each other. A ring around a pole does not close on that map: it is opened
// where it meets the antimeridian, and goes back along the pole. Each ring is cut alone, holes too,
// and holes are taken off afterwards: so nobody has to know which turn of a hole is in its area.

#include "terrain/raster/gdal/vectors/antimeridian_cut.h"

#include <cpl_error.h>
#include <ogr_geometry.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "terrain/geo/longitude.h"

namespace tind::gdal {
namespace {

using Shape = std::unique_ptr<OGRGeometry>;

constexpr double kDecimals = 1e9;  // of areas in a file: what is valid must be so with them
constexpr double kLeast = 1e-8;    // degrees, a millimetre: a narrower piece is a rounding

// --- lines ---------------------------------------------------------------------------------------

bool is_beyond(const LinePoint& p) { return std::abs(p.place.lat) > 90; }

/// Posts on a pole have lines that go on beyond it, by half a pixel.
std::vector<HeightLine> between_poles(std::span<const LinePoint> line) {
  std::vector<HeightLine> parts(1);
  for (std::size_t i = 0; i < line.size(); ++i) {
    const LinePoint& p = line[i];
    if (i > 0 && is_beyond(p) != is_beyond(line[i - 1])) {
      const LinePoint& last = line[i - 1];
      const double pole = std::copysign(90, is_beyond(p) ? p.place.lat : last.place.lat);
      const double t = (pole - last.place.lat) / (p.place.lat - last.place.lat);
      const double lon = last.place.lon + t * (p.place.lon - last.place.lon);
      parts.back().push_back({{lon, pole}, last.height_m + t * (p.height_m - last.height_m)});
      if (is_beyond(p)) parts.emplace_back();
    }
    if (!is_beyond(p)) parts.back().push_back(p);
  }
  return parts;
}

/// A point on the antimeridian is twice where a line ends or turns there.
void drop_repeated(HeightLine& part) {
  const auto same = [](const LinePoint& a, const LinePoint& b) { return a.place == b.place; };
  part.erase(std::unique(part.begin(), part.end(), same), part.end());
}

std::unique_ptr<OGRLineString> line_string(const HeightLine& part) {
  auto line = std::make_unique<OGRLineString>();
  for (const LinePoint& p : part) line->addPoint(p.place.lon, p.place.lat, p.height_m);
  return line;
}

// --- areas ---------------------------------------------------------------------------------------

/// Where a ring meets the antimeridian, behind which of its points.
struct Meeting {
  double lon = 0, lat = 0;
  std::size_t behind = 0;
};

/// The one nearest to the ring's pole: from there to the pole nothing of the ring is in the way.
Meeting nearest_meeting(const GlobeRing& ring) {
  Meeting nearest{ring.points[0].x, -ring.pole, 0};
  for (std::size_t i = 0; i + 1 < ring.points.size(); ++i) {
    const Vec2 &a = ring.points[i], &b = ring.points[i + 1];
    const auto [west, east] = std::minmax(a.x, b.x);
    for (double lon = 180 + 360 * std::ceil((west - 180) / 360); lon <= east; lon += 360) {
      const double t = a.x == b.x ? 0 : (lon - a.x) / (b.x - a.x), lat = a.y + t * (b.y - a.y);
      if (std::abs(ring.pole - lat) < std::abs(ring.pole - nearest.lat)) nearest = {lon, lat, i};
    }
  }
  return nearest;
}

std::vector<Vec2> by_way_of_the_pole(const GlobeRing& ring) {
  const Meeting cut = nearest_meeting(ring);
  const double turn = std::copysign(360, ring.points.back().x - ring.points.front().x);
  std::vector<Vec2> closed{{cut.lon, cut.lat}};
  for (std::size_t i = cut.behind + 1; i < ring.points.size(); ++i)
    closed.push_back(ring.points[i]);
  for (std::size_t i = 1; i <= cut.behind; ++i)
    closed.push_back({ring.points[i].x + turn, ring.points[i].y});
  closed.push_back({cut.lon + turn, cut.lat});
  // In steps, or readers take the way back for a crossing.
  for (int quarter = 4; quarter >= 0; --quarter)
    closed.push_back({cut.lon + turn * quarter / 4, ring.pole});
  closed.push_back(closed.front());
  return closed;
}

OGRPolygon polygon_of(std::span<const Vec2> points) {
  auto ring = std::make_unique<OGRLinearRing>();
  for (const Vec2& p : points) ring->addPoint(p.x, p.y);
  OGRPolygon polygon;
  polygon.addRingDirectly(ring.release());
  return polygon;
}

OGRPolygon turn_from(double west) {
  const Vec2 corners[] = {
      {west, -90}, {west + 360, -90}, {west + 360, 90}, {west, 90}, {west, -90}};
  return polygon_of(corners);
}

double rounded(double degrees) { return std::round(degrees * kDecimals) / kDecimals; }

/// Adds the polygons of a geometry, so many degrees to the east.
void take(const OGRGeometry& from, double east, OGRMultiPolygon& out) {
  if (OGR_GT_IsSubClassOf(wkbFlatten(from.getGeometryType()), wkbGeometryCollection)) {
    for (const OGRGeometry* part : *from.toGeometryCollection()) take(*part, east, out);
    return;
  }
  if (wkbFlatten(from.getGeometryType()) != wkbPolygon) return;
  OGREnvelope box;
  from.getEnvelope(&box);
  if (box.MaxX - box.MinX < kLeast || box.MaxY - box.MinY < kLeast) return;
  std::unique_ptr<OGRPolygon> polygon(from.toPolygon()->clone());
  for (OGRLinearRing* ring : *polygon)
    for (int i = 0; i < ring->getNumPoints(); ++i)
      ring->setPoint(i, std::clamp(rounded(ring->getX(i) + east), -180.0, 180.0),
                     rounded(ring->getY(i)));
  out.addGeometryDirectly(polygon.release());
}

using Overlay = OGRGeometry* (OGRGeometry::*)(const OGRGeometry*) const;

/// Once more with what GEOS makes of them, where rounding has let sides cross.
Shape overlay(const OGRGeometry& a, Overlay how, const OGRGeometry& b) {
  if (Shape made{(a.*how)(&b)}) return made;
  const Shape valid_a(a.MakeValid()), valid_b(b.MakeValid());
  return Shape(valid_a && valid_b ? (valid_a.get()->*how)(valid_b.get()) : nullptr);
}

bool add_pieces(const GlobeRing& ring, OGRMultiPolygon& out) {
  const OGRPolygon inside =
      ring.pole == 0 ? polygon_of(ring.points) : polygon_of(by_way_of_the_pole(ring));
  OGREnvelope box;
  inside.getEnvelope(&box);
  const auto turn = [](double lon) { return -180 + 360 * std::floor((lon + 180) / 360); };
  for (double west = turn(box.MinX); west < box.MaxX; west += 360) {
    const bool whole = box.MinX >= west && box.MaxX <= west + 360;
    const OGRPolygon window = turn_from(west);
    const Shape piece =
        whole ? Shape(inside.clone()) : overlay(inside, &OGRGeometry::Intersection, window);
    if (!piece) return false;
    take(*piece, -180 - west, out);
  }
  return true;
}

}  // namespace

std::unique_ptr<OGRGeometry> cut_line(std::span<const LinePoint> line) {
  std::vector<HeightLine> parts;
  for (HeightLine& part : between_poles(line)) {
    for (LinePoint& p : part)
      if (std::abs(p.place.lon) > 180) p.place = within_first_turn(p.place);
    for (HeightLine& piece : line_parts(part)) parts.push_back(std::move(piece));
  }
  if (parts.size() == 1) return line_string(parts[0]);
  std::ranges::for_each(parts, drop_repeated);
  std::erase_if(parts, [](const HeightLine& part) { return part.size() < 2; });
  if (parts.size() == 1) return line_string(parts[0]);
  auto lines = std::make_unique<OGRMultiLineString>();
  for (const HeightLine& part : parts) lines->addGeometryDirectly(line_string(part).release());
  return lines;
}

std::unique_ptr<OGRGeometry> valid_area(const OGRGeometry& area) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  constexpr int kMostTries = 3;  // the corners of what GEOS makes are rounded, too
  Shape valid(area.clone());
  for (int tries = 0; valid && tries < kMostTries; ++tries) {
    auto polygons = std::make_unique<OGRMultiPolygon>();
    take(*valid, 0, *polygons);
    if (!polygons->IsValid())
      valid.reset(polygons->MakeValid());
    else if (polygons->getNumGeometries() == 1)
      return Shape(polygons->getGeometryRef(0)->clone());
    else
      return polygons;
  }
  return nullptr;
}

std::unique_ptr<OGRGeometry> cut_area(std::span<const GlobeRing> rings) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  OGRMultiPolygon outer, holes;
  for (std::size_t i = 0; i < rings.size(); ++i)
    if (!add_pieces(rings[i], i == 0 ? outer : holes)) return nullptr;
  // Those of a DEM that is around the globe meet where its columns begin again.
  Shape area(outer.getNumGeometries() > 1 ? outer.UnionCascaded() : outer.clone());
  if (!area)  // rounding has let sides cross
    if (const Shape valid(outer.MakeValid()); valid) area.reset(valid->UnionCascaded());
  if (area && !holes.IsEmpty()) area = overlay(*area, &OGRGeometry::Difference, holes);
  return area ? valid_area(*area) : nullptr;
}

}  // namespace tind::gdal
