#pragma once
// What a client sees at a place that draws a level of tiles: the height of the mesh, and how far
// from the posts around it that may be.

#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/tile/tile_model.h"

namespace tind {

/// Whoever asks says where tiles come from: a store, a DEM, a cache of decoded ones.
struct LevelTiles {
  std::function<bool(TileId)> available;
  std::function<Result<TileModel>(TileId, const std::stop_token&)> tile;  // REQUIRES: available
};

struct LevelHeight {
  double height_m = 0;  // in the datum of the tiles
  TileId tile;
  /// No post of the tile is farther from its mesh; nothing where the tile does not state it.
  std::optional<double> max_error_m;
};

/// Of each place the mesh of the tile of `level` that lies there, or of the deepest one above it,
/// as clients draw it; nothing where there is no tile. Each tile is asked for once, whatever the
/// order of the places. Fails where a tile does, and (cancelled).
Result<std::vector<std::optional<LevelHeight>>> level_heights(const LevelTiles&,
                                                              std::span<const Geographic>,
                                                              int level,
                                                              const std::stop_token& = {});

}  // namespace tind
