#pragma once
// Where a place lies among the posts of a DEM that answers questions: such a DEM ends at its
// outermost posts.

#include <cmath>
#include <optional>

#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// `post`: as DemSource::to_post gives it. A coordinate within a millionth of a post's is the
/// post's: PROJ there and back is not exact. Nothing outside the outermost posts.
inline std::optional<Vec2> place_among_posts(const DemInfo& info, Vec2 post) {
  const auto snapped = [](double x) {
    return std::abs(x - std::round(x)) <= 1e-6 ? std::round(x) : x;
  };
  const double x = snapped(post.x), y = snapped(post.y);
  const bool in_cols = info.wraps_longitude || (x >= 0 && x <= double(info.cols - 1));
  if (!in_cols || !(y >= 0 && y <= double(info.rows - 1)) || !std::isfinite(x)) return {};
  return Vec2{x, y};
}

}  // namespace tind
