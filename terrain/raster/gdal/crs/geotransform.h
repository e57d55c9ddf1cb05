#pragma once
// Where a file says its pixels are.

#include <optional>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"

class GDALDataset;

namespace tind::gdal {

/// From a pixel's column and row, its centre being whole, to the coordinates of the file's CRS;
/// nothing where the file does not say it, or says what GDAL takes for nothing (one unit a pixel
/// from 0, rows going up). Fails (bad_data) where the map is singular or no numbers: no place leads
/// back to a pixel then.
Result<std::optional<Affine>> pixel_to_crs(GDALDataset&);

}  // namespace tind::gdal
