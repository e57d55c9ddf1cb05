#pragma once
// Pictures on a DEM's grid as GeoTIFF, written by GDAL (raster/gdal/).

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// Rows [row, row + rows), all columns: red, green, blue and alpha, a byte each.
using PictureRows = std::function<Result<std::vector<std::uint8_t>>(int row, int rows)>;

/// A pixel a post, in the DEM's CRS; tiled, packed by DEFLATE. `rows` is called from the north, 256
/// rows at a time. Fails with what `rows` fails with, (out_of_range) for too many columns or rows,
/// (internal) with what GDAL says.
Result<std::string> encode_picture_tiff(const DemInfo&, const PictureRows& rows);

}  // namespace tind
