#pragma once
// Vertical CRSs and geoid files as PROJ has them.

#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/raster/datums.h"

namespace tind::gdal {

/// A vertical CRS, or the vertical part of a compound one.
struct VerticalCrs {
  std::string text;          // by which PROJ knows it: "EPSG:5703", or as it was given
  std::string name;          // "NAVD88 height"
  double unit_m = 1;         // metres per unit
  bool ellipsoidal = false;  // it is a geographic CRS with heights above its ellipsoid
};

/// invalid_argument where PROJ knows none of that name, or it counts downwards.
Result<VerticalCrs> vertical_crs(const std::string& text);

/// PROJ's best way from a vertical CRS to WGS84 whose grids are there. See datum_surface.
Result<std::shared_ptr<const DatumSurface>> proj_surface(const std::string& crs,
                                                         const GeoRect& area,
                                                         const std::string& crs_wkt);

/// A .gtx or .tif of undulations, bilinear.
Result<std::shared_ptr<const DatumSurface>> grid_surface(const std::string& path);

/// Where PROJ looks for grids, for messages.
std::string proj_folders();

}  // namespace tind::gdal
