#pragma once
// A region as people say it, in longitude and latitude, and over a DEM's posts.

#include <vector>

#include "terrain/base/result.h"
#include "terrain/progressive/region.h"
#include "terrain/raster/dem_source.h"

namespace tind {

struct GeoRegion {
  std::vector<Geographic> points;
  bool closed = true;  // a polygon; else a route
  double width_m = 0;  // of the corridor along a route, both sides together

  /// Its sides follow their parallels (16 points each) in whatever projection the DEM has.
  static GeoRegion box(const GeoRect&);

  /// Over the posts of `dem`, of which (col, row) is (0, 0). Fails (invalid_argument) for too few
  /// points, a place that is none or a corridor without width, (unsupported) for a DEM without a
  /// place on the earth.
  Result<Region> over(const DemSource& dem, std::int64_t col = 0, std::int64_t row = 0) const;
};

}  // namespace tind
