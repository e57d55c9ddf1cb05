#pragma once
// Where a tile set lies, by what its layer.json says is there: its `bounds` are -180..180 where it
// crosses the antimeridian.

#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/base/result.h"
#include "terrain/geo/availability.h"
#include "terrain/geo/coordinates.h"
#include "terrain/store/tile_store.h"

namespace tind {

/// The layer.json of a store; fails as reading it does, or where it is none.
Result<proto::LayerJson> layer_of(const TileStore&);

/// The tiles of a level, as it lists them.
TileArea area_of(const std::vector<proto::TileRange>& level);

/// The bounds; where these go around the earth, the box around its tiles (as box_around() has it),
/// to a tile, if that leaves out a quarter of the earth: narrower gaps may lie between the tiles of
/// two levels.
GeoRect layer_box(const proto::LayerJson&);

/// The ranges of its deepest level, within the bounds: where the ground is best known. Empty where
/// it does not say.
std::vector<GeoRect> deepest_ranges(const proto::LayerJson&);

}  // namespace tind
