#pragma once
// What a DEM is like inside a polygon: of its posts the usual statistics, of its surface area and
// volume.

#include <cstddef>
#include <memory>

#include "terrain/analysis/area_integral.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind {

struct ZonalStatistics {
  std::size_t posts = 0, voids = 0;  // posts inside with a height, and without
  /// Of the posts; meaningless without any. `std_m`: of all of them, not of a sample.
  double min_m = 0, max_m = 0, mean_m = 0, std_m = 0, median_m = 0;
  double area_m2 = 0, void_area_m2 = 0;  // as AreaIntegral has them
  double surface_mean_m = 0;             // of the bilinear surface: volume over area
  double volume_m3 = 0;                  // between surface and base, negative where that is higher
  bool beyond = false;                   // some of the polygon lies beyond the DEM
};

/// A post is inside when it is in an odd number of rings; one on an edge counts to the east and the
/// south, so that polygons side by side share no post. Median: the middle one, of an even number
/// the mean of two. Reads the posts around the polygon alone; 4 bytes each inside. Fails with the
/// source's errors.
Result<ZonalStatistics> zonal_statistics(std::shared_ptr<const DemSource>, const PostRings& polygon,
                                         double base_m = 0);

}  // namespace tind
