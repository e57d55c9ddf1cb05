#pragma once
// What the numbers of a raster file are, as the file and the operator say it: for people who want
// to know what is read as heights.

#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind {

struct RasterContent {
  std::string type;         // of a number, "Int16", as GDAL calls it
  int band = 1, bands = 1;  // the one that is read; with colours the first of three
  HeightEncoding encoding = HeightEncoding::number;
  double scale = 1, offset = 0;  // height = number * scale + offset, in units of unit_m metres
  double unit_m = 1;
  std::vector<double> nodata;  // numbers that mean no data
  bool mask = false;           // a mask or a band of transparency says so, too
};

/// Whether a reader of rasters knows the file by its first bytes, whatever else is wrong with it.
bool is_raster(const std::string& path);

/// Of one file, whose blocks are not read. Fails as DemSource::open does of it.
Result<RasterContent> raster_content(const std::string& path, const DemOptions& = {});

}  // namespace tind
