#pragma once
// Lines of equal height, as vector files; found and written by GDAL (raster/gdal/).

#include <string>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"

namespace tind {

enum class ContourFormat { geopackage, flatgeobuf, geojson };

/// By the extension, .gpkg, .fgb, .geojson or .json, any case. Fails (invalid_argument) with what
/// there is.
Result<ContourFormat> contour_format(const std::string& path);

struct ContourOptions {
  double interval_m = 0;            // 0: only `levels`
  double base_m = 0;                // one of the heights that are multiples of the interval away
  std::vector<double> levels = {};  // metres; then without the interval
};

struct ContourFile {
  std::string bytes;
  std::size_t lines = 0;
};

/// One layer "contours" of LineStringZ with a field `height_m`, in the DEM's CRS (GeoJSON: in
/// longitude and latitude, RFC 7946). A line is where the linear interpolation along rows and
/// columns, and GDAL's between them, has the height: within cells with a void there is none. The
/// same posts are the same bytes. `posts` are all of the DEM. Fails (invalid_argument) for a range
/// of heights that makes more than 10,000 levels, and GeoJSON of a DEM without CRS, (cancelled).
Result<ContourFile> encode_contours(ContourFormat, const DemInfo&, const HeightGrid& posts,
                                    const ContourOptions&, const Progress& = {});

}  // namespace tind
