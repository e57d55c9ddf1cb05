#pragma once
// THE list of coordinate systems in tind. Every other header refers to these names.
//
//   post        (col, row) of a DEM's sample. Integers are sample positions: (0, 0) is the *centre*
//               of the top-left pixel; row grows to the south. Fractions lie between the samples.
//   crs         (x, y) in the DEM's own reference system, in its own units, traditional GIS order
//               (easting/longitude first, whatever the authority's axis order says).
//   geographic  longitude, latitude in degrees, WGS84, longitude first.
//   metric      a local metric frame: x east, y north, metres, origin at the DEM's first post.
//   ecef        earth-centred, earth-fixed, metres, WGS84.
//   tile        (u, v, h): u east, v NORTH, integers 0..32767 across a tile's rectangle, exactly 0
//               and 32767 on its edges; h 0..32767 between the tile's min and max height.
//
// Heights are metres. "orthometric" is above the geoid (EGM96 where not said otherwise),
// "ellipsoidal" above the WGS84 ellipsoid. "vertical error" is a difference of heights at
// one place.
//
// Tile rows: TMS counts from the south (row 0 touches latitude -90); XYZ counts from the north.
// Inside tind a TileId is always TMS.

#include <cmath>
#include <compare>

namespace tind {

struct Vec2 {
  double x = 0, y = 0;
  friend bool operator==(const Vec2&, const Vec2&) = default;
};

struct Vec3 {
  double x = 0, y = 0, z = 0;
  friend bool operator==(const Vec3&, const Vec3&) = default;
};

inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(const Vec3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Vec3& a) { return std::sqrt(dot(a, a)); }

/// Longitude and latitude, degrees, WGS84.
struct Geographic {
  double lon = 0, lat = 0;
  friend bool operator==(const Geographic&, const Geographic&) = default;
};

/// A rectangle in longitude and latitude, degrees. west < east; does not cross the antimeridian.
struct GeoRect {
  double west = 0, south = 0, east = 0, north = 0;
  friend bool operator==(const GeoRect&, const GeoRect&) = default;

  double width() const { return east - west; }
  double height() const { return north - south; }
  bool contains(Geographic p) const {
    return p.lon >= west && p.lon <= east && p.lat >= south && p.lat <= north;
  }
  bool overlaps(const GeoRect& o) const {
    return west < o.east && o.west < east && south < o.north && o.south < north;
  }
};

/// An affine map of post coordinates (col, row) to crs coordinates (x, y).
struct Affine {
  double x0 = 0, x_col = 1, x_row = 0;
  double y0 = 0, y_col = 0, y_row = -1;
  friend bool operator==(const Affine&, const Affine&) = default;

  Vec2 apply(double col, double row) const {
    return {x0 + col * x_col + row * x_row, y0 + col * y_col + row * y_row};
  }
  /// REQUIRES: the map is not singular.
  Vec2 invert(double x, double y) const {
    const double det = x_col * y_row - x_row * y_col;
    const double dx = x - x0, dy = y - y0;
    return {(dx * y_row - dy * x_row) / det, (x_col * dy - y_col * dx) / det};
  }
};

}  // namespace tind
