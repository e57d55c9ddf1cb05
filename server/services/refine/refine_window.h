#pragma once
// Which posts of a dataset one multi-triangulation is made of: all, or a window of a large one.

#include <cstddef>
#include <cstdint>
#include <optional>

#include "terrain/base/result.h"
#include "terrain/progressive/multires/geo_region.h"
#include "terrain/raster/dem_source.h"

namespace tind::services {

struct RefineWindow {
  std::int64_t col = 0, row = 0;
  int cols = 0, rows = 0;
  friend auto operator<=>(const RefineWindow&, const RefineWindow&) = default;
};

/// The posts in `asked`; without it all of them, if they are not more than `most`. Widened to
/// multiples of 64 posts, so that who asks for nearly the same gets the same. Fails
/// (invalid_argument) for more than `most` posts or none, (unsupported) for a window across the
/// seam of a DEM that goes around the globe.
Result<RefineWindow> refine_window(const DemSource&, const std::optional<GeoRect>& asked,
                                   std::size_t most);

/// A region and a tenth of its size on each side.
GeoRect around(const GeoRegion&);

}  // namespace tind::services
