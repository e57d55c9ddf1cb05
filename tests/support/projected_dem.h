#pragma once
// Small rough DEMs in any projection: an ASCII grid and a VRT around it that names the CRS.

#include <fstream>
#include <memory>
#include <string>

#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"
#include "tests/support/support.h"

namespace tind::test {

struct ProjectedDem {
  const char* name;
  const char* crs;
  double west, north, step;  // the first post, and from post to post, metres
  int cols, rows;
};

inline std::shared_ptr<const DemSource> open_projected(const ProjectedDem& dem,
                                                       const TempDir& folder) {
  const HeightGrid heights = rough_terrain(dem.cols, dem.rows, 5, 4000);
  const std::string grid = std::string(dem.name) + ".asc", path = folder.file(grid + ".vrt");
  std::ofstream out(folder.file(grid));
  out << "ncols " << dem.cols << "\nnrows " << dem.rows
      << "\nxllcenter 0\nyllcenter 0\ncellsize 1\nNODATA_value -9999\n";
  for (int r = 0; r < dem.rows; ++r)
    for (int c = 0; c < dem.cols; ++c)
      out << int(heights.at(c, r)) << (c + 1 < dem.cols ? ' ' : '\n');
  out.close();
  std::ofstream vrt(path);
  vrt.precision(17);
  vrt << "<VRTDataset rasterXSize=\"" << dem.cols << "\" rasterYSize=\"" << dem.rows << "\"><SRS>"
      << dem.crs << "</SRS><GeoTransform>" << dem.west - dem.step / 2 << "," << dem.step << ",0,"
      << dem.north + dem.step / 2 << ",0," << -dem.step << "</GeoTransform>"
      << "<VRTRasterBand dataType=\"Int16\" band=\"1\"><SimpleSource>"
      << "<SourceFilename relativeToVRT=\"1\">" << grid << "</SourceFilename>"
      << "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>";
  vrt.close();
  const auto source = DemSource::open({&path, 1}, {.allow_vrt = true});
  return source ? *source : nullptr;
}

}  // namespace tind::test
