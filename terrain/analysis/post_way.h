#pragma once
// A curve on the globe as straight pieces among a DEM's posts: what of it can be walked exactly.

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// Where the curve is after a share of it, 0..1: of many shares at once.
using Curve = std::function<void(std::span<const double> shares, std::span<Geographic> places)>;

struct WayNode {
  double share = 0;  // of the curve
  Vec2 post;         // columns of a DEM around the globe go on beyond its first and last
};

/// Nodes between which the curve is straight among the posts but for `tolerance_posts`, both ends
/// among them, at equal shares. As many as that takes, at least `pieces` + 1: a power of two times
/// that. Fails (invalid_argument) where the DEM has no CRS or its projection knows no such place.
/// O(nodes) transformations.
Result<std::vector<WayNode>> straight_pieces(const DemSource&, const Curve&, double tolerance_posts,
                                             std::size_t pieces = 1);

}  // namespace tind
