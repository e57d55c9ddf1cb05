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
  bool ellipsoidal = false;  // it is a 3D CRS, in metres above an ellipsoid of WGS84's size
};

/// Of the size and shape of WGS84's, or of GRS80's, to less than a millimetre?
bool is_wgs84_or_grs80(double semi_major_m, double inverse_flattening);

/// invalid_argument where PROJ knows none of that name, or it counts downwards; unsupported
/// where it counts from another ellipsoid than WGS84's, or from an ellipsoid in another unit than
/// metres.
Result<VerticalCrs> vertical_crs(const std::string& text);

/// PROJ's best way from a vertical CRS to WGS84 whose grids are there. Of a compound one the
/// heights count: its horizontal part, easting and northing or grads, only decides between the
/// ways. See datum_surface.
Result<std::shared_ptr<const DatumSurface>> proj_surface(const std::string& crs,
                                                         const GeoRect& area,
                                                         const std::string& crs_wkt);

/// A .gtx or .tif of undulations, bilinear.
Result<std::shared_ptr<const DatumSurface>> grid_surface(const std::string& path);

/// Where PROJ looks for grids, for messages.
std::string proj_folders();

}  // namespace tind::gdal
