#pragma once
// A TIN on a grid of posts: so that whatever can be asked of a DEM can be asked of a TIN, and the
// answer says how far the surface that was asked may be from the TIN.

#include <cstdint>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/mesh/between_posts.h"
#include "terrain/mesh/tin.h"
#include "terrain/raster/height_grid.h"

namespace tind {

struct TinPosts {
  HeightGrid heights;  // metres: the TIN's own at each post; void where no triangle is
  Affine post_to_tin;  // north up, the outermost posts on the rectangle around the TIN
  /// How far the surface between posts (bilinear, as every DEM's) is from the TIN at most, over all
  /// places where both are: exactly, not by samples (between_posts.h). At posts it is only what
  /// floats round.
  SurfaceError error;
};

inline constexpr std::int64_t kMostTinPosts = 400'000'000;

/// `tin`: terrain, as as_terrain() makes it, x east and y north; `unit_m`: metres per unit of x, y
/// and z. Posts are at most `spacing_m` apart, in equal steps from side to side, so that a TIN that
/// fills its rectangle has all of it between posts; of another outline, cells that it crosses lack
/// posts, and what is left of them by the rule of raster/interpolate.h is all that is asked.
/// Fails (out_of_range) for more than kMostTinPosts. O(posts + triangles + cells that edges cross).
Result<TinPosts> tin_posts(const Tin&, const Vec3& unit_m, double spacing_m, int threads = 0);

}  // namespace tind
