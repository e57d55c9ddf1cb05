#pragma once
// What can be seen from a place: the line of sight to every post around it.

#include <limits>

#include "terrain/analysis/line_of_sight.h"
#include "terrain/analysis/sight_ray.h"
#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"
#include "terrain/raster/raster_file.h"

namespace tind {

struct ViewshedOptions {
  SightEnd observer;
  double target_above_ground_m = 0;
  double radius_m = std::numeric_limits<double>::infinity();  // on the ellipsoid
  SightRules rules{.tolerance_posts = 1e-3};
  int threads = 0;
};

struct Viewshed {
  HeightGrid visibility;  // 0 hidden, 1 visible, 2 depends; NaN: a void, or beyond the radius
  std::size_t hidden = 0, visible = 0, depends = 0;
};

/// The posts within the radius as a DEM of their own (dem_window()). Fails as posts_around() does.
Result<std::shared_ptr<const DemSource>> dem_around(std::shared_ptr<const DemSource>,
                                                    const ViewshedOptions&);

/// Every post by the same ray as line_of_sight() ("R3"), with certainty for those that are not
/// `depends`: sweeps and plane-by-plane methods (gdal_viewshed) are faster, but take the ground
/// between posts from neighbours that the ray does not cross, so that nothing can be promised of
/// them. O(posts * posts across); about 1 s for 10^8 cells crossed and thread. `posts`: all of the
/// DEM. Fails as line_of_sight() does, and (cancelled).
Result<Viewshed> viewshed(const DemSource&, const HeightGrid& posts, const ViewshedOptions&,
                          const Progress& = {});

/// What a raster of it says of itself.
RasterContents viewshed_contents();

}  // namespace tind
