#pragma once
// From a tile to its parent's part of the same area, as bytes.

#include <span>

#include "proto/transition.h"
#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/progressive/terrain_transition.h"
#include "terrain/pyramid/tileset.h"

namespace tind {

/// A pure function of the two tiles. `level` > 0. Fails (bad_data), naming the tile and the place,
/// where they cannot be brought together.
Result<proto::Transition> tile_transition(TileId tile, const TileBytes& fine,
                                          const TileBytes& parent);

/// As the library works with it. REQUIRES: what tile_transition or decode_transition gave.
TerrainTransition from_wire(const proto::Transition&);

}  // namespace tind
