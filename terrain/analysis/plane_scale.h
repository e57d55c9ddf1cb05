#pragma once
// How far the plane of a DEM's projection is from the ground: near enough in UTM, in Web Mercator
// lengths are 1 / cos of the latitude times too long.

#include "terrain/analysis/area_integral.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"

namespace tind {

// Both by a lattice of places of a rectangle. 1 where posts are in degrees, and without a CRS.

/// How many times as large as on the ellipsoid areas are that GroundArea has.
struct AreaScale {
  double least = 1, greatest = 1;  // in the area
};

/// Of the rectangle around the area, as far as that is on the DEM.
AreaScale area_scale(const DemSource&, const PostRings& area);
/// The same of a rectangle of posts, also beyond the DEM's own.
AreaScale area_scale(const DemSource&, Vec2 low, Vec2 high);

/// How many times as long as on the ellipsoid lengths are: in any direction, because a projection
/// can stretch one more than another.
struct LengthScale {
  double least = 1, greatest = 1;  // all over the DEM
  /// The most that lengths are longer in one direction than in another at the same place: what
  /// turns directions.
  double uneven = 1;
};

/// Of all of a DEM.
LengthScale length_scale(const DemSource&);

}  // namespace tind
