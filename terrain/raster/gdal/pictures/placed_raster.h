#pragma once
// A raster that says where it is, opened: an image or classes, to lie over a surface.

#include <gdal_priv.h>

#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/raster/gdal/crs/gdal_frame.h"

namespace tind::gdal {

struct PlacedRaster {
  struct Close {
    void operator()(GDALDataset* set) const { GDALClose(set); }
  };
  std::unique_ptr<GDALDataset, Close> set;
  Frame frame;
  std::string place;  // stands for where its pixels are
};

/// Of the formats that a DEM may have; at least one band. `what`: it is not, where it is none.
/// bad_data: no raster, or one without a CRS or a place.
Result<PlacedRaster> open_placed(const std::string& path, const char* what);

}  // namespace tind::gdal
