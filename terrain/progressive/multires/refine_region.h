#pragma once
// Selective refinement: one mesh with one error inside a region and another outside.

#include <algorithm>

#include "terrain/progressive/multires/front.h"
#include "terrain/progressive/multires/region.h"

namespace tind {

struct RegionErrors {
  double inside_m = 0;   // over every post in the region; 0: as fine as it gets
  double outside_m = 0;  // over every other post
};

/// What to ask for so that these hold of a source whose posts in memory lie up to `rounding_m`
/// beside its heights (raster/height_rounding.h).
inline RegionErrors within_rounding(const RegionErrors& asked, double rounding_m) {
  return {std::max(0.0, asked.inside_m - rounding_m), std::max(0.0, asked.outside_m - rounding_m)};
}

/// The smallest front of which every triangle that touches the region is within inside_m of all its
/// posts, and every other within outside_m. Where the finest triangles are worse, they stay.
/// REQUIRES: inside_m <= outside_m. Depends on the arguments alone. O(triangles made).
Front refine_region(const MultiTriangulation&, const Region&, const RegionErrors&);

}  // namespace tind
