#pragma once
// From the shapes that a user gave to a network of straight parts over the DEM: clipped to its
// rectangle, repaired (constrained_delaunay.h), cut at the rims of voids, each part divided where
// the ground under it asks for a height.

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
