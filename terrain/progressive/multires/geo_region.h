#pragma once
// A region as people say it, in longitude and latitude, and over a DEM's posts.

#include <optional>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/progressive/multires/region.h"
#include "terrain/raster/dem_source.h"

namespace tind {

struct GeoRegion {
  std::vector<Geographic> points;
  bool closed = true;  // a polygon; else a route
  double width_m = 0;  // of the corridor along a route, both sides together

  std::optional<GeoRect> bounds = {};  // of a box, as it was given

  /// Its sides follow their parallels (16 points each) in whatever projection the DEM has. Across
  /// the antimeridian longitudes count on: 179 to 181.
  static GeoRegion box(const GeoRect&);

  /// Over the posts of `dem`, of which (col, row) is (0, 0), wherever around the earth either
  /// counts its longitudes from: the whole region is moved by full turns. Between two points of a
  /// route the shorter way around is meant; a polygon and a box are as wide as they say. Fails
  /// (invalid_argument) for too few points, a place that is none, a box with its sides exchanged, a
  /// corridor without width, and for a region that has no part of the DEM in it, (unsupported) for
  /// a DEM without a place on the earth.
  Result<Region> over(const DemSource& dem, std::int64_t col = 0, std::int64_t row = 0) const;
};

}  // namespace tind
