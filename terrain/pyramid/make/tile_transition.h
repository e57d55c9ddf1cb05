#pragma once
// From a tile to its parent's part of the same area, as bytes.

#include <cstdint>
#include <span>
#include <stop_token>

#include "proto/stream/transition.h"
#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/progressive/transition/terrain_transition.h"

namespace tind {

/// A pure function of the two quantized-mesh tiles, not compressed; a tile that states no error
/// counts as 0. `level` > 0. Fails (bad_data), naming the tile and the place, where they cannot be
/// brought together, and (cancelled).
Result<proto::Transition> tile_transition(TileId tile, std::span<const std::uint8_t> fine,
                                          std::span<const std::uint8_t> parent,
                                          const std::stop_token& = {});

/// As the library works with it. REQUIRES: what tile_transition or decode_transition gave.
TerrainTransition from_wire(const proto::Transition&);

}  // namespace tind
