#pragma once
// Where a tile set lies, by what its layer.json says is there: its `bounds` are -180..180 where it
// crosses the antimeridian.

#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/geo/coordinates.h"

namespace tind {

/// The bounds; where these go around the earth, the box around its tiles (as box_around() has it),
/// to a tile, if that leaves out a quarter of the earth: narrower gaps may lie between the tiles of
/// two levels.
GeoRect layer_box(const proto::LayerJson&);

/// The ranges of its deepest level, within the bounds: where the ground is best known. Empty where
/// it does not say.
std::vector<GeoRect> deepest_ranges(const proto::LayerJson&);

}  // namespace tind
