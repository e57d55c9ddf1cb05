#pragma once
// GDAL's .aux.xml beside a raster is not read: it could say anything of a file that somebody else
// vouches for. What it says of heights is told, and a CRS where the raster has none: GDAL 3.6 puts
// a projected CRS of three axes there, and nothing of it into a GeoTIFF.

#include <string>

#include "terrain/raster/raster_content.h"

namespace tind::gdal {

/// "dem.tif.aux.xml says unit ft, scale 0.5", as far as it is not what `read` has; empty: there is
/// none, or nothing of that in it. Looks at 64 KiB at most, for a few elements by their names: no
/// parser of XML meets, outside of the sandbox, what somebody has put beside a raster.
std::string unread_sidecar(const std::string& path, const RasterContent& read, bool has_crs = true);

/// The .prj beside a raster that has no CRS all the same: GDAL says nothing of one that is no WKT,
/// and does not look for one with a GeoTIFF. Empty: there is none.
std::string prj_without_crs(const std::string& path);

}  // namespace tind::gdal
