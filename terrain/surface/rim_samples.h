#pragma once
// Where an upper layer ends, what lies below is bent to it, and there may be no post for miles:
// places where a tile's mesh is held to H all the same.

#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/surface/height_field.h"

namespace tind {

/// Beside the valid posts of each upper layer, as far as it bends what lies below (voids in it,
/// too): every so many places of its own lattice, and H there, in tile coordinates. Sixteen or more
/// across the blend, but no more than 256 across the tile. None of a surface of one DEM. A pure
/// function of surface and rectangle, in whose grid they are. `of_degrees`: only those that a tile
/// of this height has there; so parts have what the whole has. Of two heights the larger one's are
/// among the smaller one's.
Result<std::vector<Vec3>> rim_samples(const HeightField&, const GeoRect&, double of_degrees);
inline Result<std::vector<Vec3>> rim_samples(const HeightField& field, const GeoRect& rect) {
  return rim_samples(field, rect, rect.height());
}
inline Result<std::vector<Vec3>> rim_samples(const HeightField& field, TileId tile) {
  return rim_samples(field, tiling::rect(tile));
}

}  // namespace tind
