#pragma once
// Heights on a DEM's grid as files: GeoTIFF and Esri ASCII, written by GDAL (raster/gdal/).

#include <functional>
#include <string>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind {

enum class RasterFormat { geotiff, ascii_grid };

/// By the extension, .tif, .tiff or .asc, any case. Fails (invalid_argument) with what there is.
Result<RasterFormat> raster_format(const std::string& path);

/// Fails (invalid_argument) where an ASCII grid cannot say where the DEM's posts are: rotated, or
/// with its first row in the south. To be asked before long work.
Result<void> can_say(RasterFormat, const DemInfo&);

/// Rows [row, row + rows), all columns; NaN where there is no value.
using RasterRows = std::function<Result<HeightGrid>(int row, int rows)>;

struct RasterBytes {
  std::string bytes;
  std::string prj;  // ASCII grid: the CRS, for a file beside it; empty where there is none
};

/// A raster of float32 with the DEM's posts as pixel centres and its CRS; -9999 where there is no
/// value. `heights`: the values are metres above the DEM's datum, which the GeoTIFF then names;
/// else they are differences. GeoTIFF is tiled and deflated. `rows` is called from the north, 256
/// rows at a time. Fails with what `rows` fails with, or (internal) with what GDAL says.
Result<RasterBytes> encode_raster(RasterFormat, const DemInfo&, bool heights,
                                  const RasterRows& rows);

}  // namespace tind
