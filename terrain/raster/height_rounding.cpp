#include "terrain/raster/height_rounding.h"

#include <algorithm>
#include <cmath>

namespace tind {

double height_rounding(const DemInfo& info, const HeightGrid& heights) {
  if (info.rounding_m == 0) return 0;
  float highest = 0;
  for (const float h : heights.values()) highest = std::max(highest, std::fabs(h));  // not of voids
  // Half of the step from a float to the next; one that was rounded up to a power of two had the
  // finer one below it.
  return highest > 0 ? std::min(info.rounding_m, std::ldexp(1.0, std::ilogb(highest) - 24)) : 0;
}

}  // namespace tind
