#pragma once
// A window of heights as a file.

#include <string>
#include <vector>

#include "server/api/ogc/asked_crs.h"
#include "server/api/ogc/coverage_query.h"
#include "terrain/geo/vertical_datum.h"

namespace tind::api::ogc {

struct CoverageHeights {
  CoverageWindow window;
  std::vector<float> heights;  // rows from the north; NaN where there is none
  VerticalDatum datum;
};

struct CoverageFile {
  std::string bytes;
  const char* media_type = "";
};

/// GeoTIFF and ASCII grid: raster/raster_file.h. PNG: 16 bits of grey, the least height 1 and the
/// greatest 65535, 0 where there is none; its texts say which heights these are. CoverageJSON: the
/// middles of pixels. Errors: those of encode_raster().
Result<CoverageFile> coverage_file(CoverageFormat, const AskedCrs&, const CoverageHeights&);

}  // namespace tind::api::ogc
