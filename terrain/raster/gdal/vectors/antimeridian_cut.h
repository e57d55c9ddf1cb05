#pragma once
// Lines and areas on the globe as GeoJSON wants them: cut at the antimeridian (RFC 7946, section
// 3.1.9), so that no part leaves -180..180 or jumps from one end to the other. GDAL's driver does
// that by guesses: it takes steps of more than 350 degrees for crossings, and loses heights.

#include <memory>
#include <span>
#include <vector>

#include "terrain/geo/coordinates.h"
#include "terrain/geo/line_parts.h"

class OGRGeometry;

namespace tind::gdal {

/// Longitudes in any turn; what is beyond a pole is left out, as are the parts of a line that are
/// one point. LineString Z, or MultiLineString Z; empty where nothing is left.
std::unique_ptr<OGRGeometry> cut_line(std::span<const LinePoint>);

/// A ring whose longitudes have no jumps, and so may leave -180..180. The last point is the first;
/// where the ring is around a pole, a turn later.
struct GlobeRing {
  std::vector<Vec2> points;  // longitude, latitude
  double pole = 0;           // the latitude of the pole that it is around; 0: of none
};

/// The area in the first ring that is in none of the others; around a pole it has the pole's edge
/// of the map as a side. Polygon or MultiPolygon, valid with its 9 decimals; empty where the area
/// is narrower than a millimetre. Null where GEOS cannot make it valid.
std::unique_ptr<OGRGeometry> cut_area(std::span<const GlobeRing>);

/// The same of an area that has nothing to be cut.
std::unique_ptr<OGRGeometry> valid_area(const OGRGeometry&);

}  // namespace tind::gdal
