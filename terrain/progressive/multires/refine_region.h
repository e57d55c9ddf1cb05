#pragma once
// Selective refinement: one mesh with one error inside a region and another outside.

#include "terrain/progressive/multires/front.h"
#include "terrain/progressive/multires/region.h"

namespace tind {

struct RegionErrors {
  double inside_m = 0;   // over every post in the region; 0: as fine as it gets
  double outside_m = 0;  // over every other post
};

/// The smallest front of which every triangle that touches the region is within inside_m of all its
/// posts, and every other within outside_m. Where the finest triangles are worse, they stay.
/// REQUIRES: inside_m <= outside_m. Depends on the arguments alone. O(triangles made).
Front refine_region(const MultiTriangulation&, const Region&, const RegionErrors&);

}  // namespace tind
