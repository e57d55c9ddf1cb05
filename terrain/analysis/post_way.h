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

struct WayPiece {
  double from_share = 0, to_share = 0;  // of the curve
  Vec2 from, to;  // posts; columns of a DEM around the globe go on beyond its first and last
};

/// Pieces of the curve, in its order, that are straight among the posts but for `tolerance_posts`:
/// `pieces`, or more where that does not do.
/// Where it goes over a pole a piece too short to matter is missing. Fails (invalid_argument) where
/// the DEM has no CRS or its projection knows no such place. O(pieces) transformations.
Result<std::vector<WayPiece>> straight_pieces(const DemSource&, const Curve&,
                                              double tolerance_posts, std::size_t pieces = 1);

}  // namespace tind
