#include "server/services/tiles/finished_model.h"

#include <utility>

#include "terrain/encode/quantized_mesh_tile.h"

namespace tind::services {

Result<TileModel> finished_model(TileService& tiles, const ServedDataset& dataset, TileId tile,
                                 std::stop_token stop) {
  const auto whole = tiles.make_now(dataset, tile, dataset.offered, std::move(stop));
  if (!whole) return std::unexpected(whole.error());
  auto model = decode_tile(tile, (*whole)->bytes());
  if (!model) return fail(dataset.name + " " + tile.text(), model.error());
  return model;
}

LevelTiles level_tiles(TileService& tiles, const ServedDataset& dataset) {
  return {[&dataset](TileId tile) { return dataset.has(tile); },
          [&tiles, &dataset](TileId tile, const std::stop_token& stop) {
            return finished_model(tiles, dataset, tile, stop);
          }};
}

}  // namespace tind::services
