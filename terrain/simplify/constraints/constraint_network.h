#pragma once
// Turns the user's shapes into a network of straight parts over the DEM. The shapes are clipped to
// its rectangle, repaired (constrained_delaunay.h) and cut at the rims of voids. Each part is
// divided wherever the terrain under it needs another height.

#include <cstdint>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/height_grid.h"
#include "terrain/simplify/constraints/constraints.h"

namespace tind {

struct NetworkPart {
  std::uint32_t a, b;  // points of the network
  bool line = false;   // not only the rim of a void
  bool own_heights = false;
  std::vector<Vec3> inner;  // points on it exactly, in order: posts, and its halves, quarters ...
};

struct ConstraintNetwork {
  std::vector<Vec3> points;
  std::vector<NetworkPart> parts;
  PolygonSet flat, boundary;
  std::vector<std::vector<std::uint32_t>> flat_points;  // on each flat polygon's outline
};

/// Heights are those of the shapes, NaN where they bring none. O(n log n) in segments and parts.
Result<ConstraintNetwork> constraint_network(const HeightGrid&, const ConstraintShapes&,
                                             ConstraintReport&);

}  // namespace tind
