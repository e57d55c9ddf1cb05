#pragma once
// A finished tile, wherever it comes from, as what other formats are made of.

#include <stop_token>

#include "server/services/tiles/tile_service.h"
#include "terrain/base/result.h"
#include "terrain/tile/level_heights.h"
#include "terrain/tile/tile_model.h"

namespace tind::services {

/// Of the tile as it is sent, so that a store and a DEM give the same; from the cache, or made
/// here. REQUIRES: on a worker; dataset.tiles->available(tile).
Result<TileModel> finished_model(TileService&, const ServedDataset&, TileId, std::stop_token);

/// All of them, for questions about a level; as long as both arguments are there. REQUIRES: asked
/// on a worker.
LevelTiles level_tiles(TileService&, const ServedDataset&);

}  // namespace tind::services
