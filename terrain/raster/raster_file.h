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

enum class RasterPacking { deflate, lzw };
/// float32: -9999 where there is no value. uint8: rounded, 0 there. classes: a byte, too, 255
/// there.
enum class RasterPixel { float32, uint8, classes };

struct RasterContents {
  /// Metres above the DEM's datum, which a GeoTIFF then names; else differences of such.
  bool heights = true;
  const char* what = "height of the mesh";  // in words
  const char* unit = "metre";
  RasterPixel pixel = RasterPixel::float32;
  RasterPacking packing = RasterPacking::deflate;
  bool voids = true;    // can there be places without a value?
  bool points = false;  // values are of places, not of pixels: what GeoTIFF says of them
};

/// A raster with the DEM's posts as pixel centres and its CRS. GeoTIFF is tiled and packed by
/// DEFLATE with prediction; or in strips by LZW without, which the oldest readers know. `rows` is
/// called from the north, 256 rows at a time. Fails with what `rows` fails with, or (internal) with
/// what GDAL says.
Result<RasterBytes> encode_raster(RasterFormat, const DemInfo&, const RasterContents&,
                                  const RasterRows& rows);

}  // namespace tind
