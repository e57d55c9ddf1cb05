#pragma once
// A DEM of degrees that is read from a file, with all that a source makes of its place: beyond 180
// degrees, too.

#include <fstream>
#include <iomanip>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"
#include "tests/support/support.h"

namespace tind::test {

/// `south_west`: its post there. `rows_apart`: another spacing of rows; 0: the same.
inline std::shared_ptr<const DemSource> text_dem(const TempDir& folder, const std::string& name,
                                                 const HeightGrid& grid, Geographic south_west,
                                                 double spacing, double rows_apart = 0) {
  const std::string path = folder.file(name + ".asc");
  std::ofstream file(path);
  file << std::setprecision(12) << "ncols " << grid.cols() << "\nnrows " << grid.rows()
       << "\nxllcenter " << south_west.lon << "\nyllcenter " << south_west.lat;
  if (rows_apart > 0)
    file << "\ndx " << spacing << "\ndy " << rows_apart << '\n';
  else
    file << "\ncellsize " << spacing << '\n';
  file << "NODATA_value -99999\n";
  for (int r = 0; r < grid.rows(); ++r)
    for (int c = 0; c < grid.cols(); ++c)
      file << (grid.is_void(c, r) ? -99999 : grid.at(c, r)) << (c + 1 == grid.cols() ? '\n' : ' ');
  file.close();
  DemOptions options;
  options.crs = "EPSG:4326";
  auto opened = DemSource::open(std::vector{path}, options);
  if (!opened) throw std::runtime_error(opened.error().what);
  return *opened;
}

}  // namespace tind::test
