#pragma once
// Which vector files give a dataset its lines and its water.

#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"

namespace tind {

struct ShapeFiles {
  std::vector<std::string> breaklines;  // their lines stay edges of tiles
  std::vector<std::string> flatten;     // their polygons become level
  std::vector<std::string> boundary;    // posts outside their polygons do not count
  std::vector<std::string> water;       // polygons, or rasters: what the water mask shows
  bool dem_heights = false;             // of lines and levels: the DEM's, whatever the files say

  bool any() const {
    return !(breaklines.empty() && flatten.empty() && boundary.empty() && water.empty());
  }
  friend bool operator==(const ShapeFiles&, const ShapeFiles&) = default;
};

/// One setting by its name, as configurations have it: breaklines, flatten, boundary, water (a
/// file; said again, one more) or line_heights (line, dem). Fails (invalid_argument) for what is
/// none.
Result<void> set_shape_option(ShapeFiles&, std::string_view name, std::string_view value);

}  // namespace tind
