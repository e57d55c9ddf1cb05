#include "server/services/tiles/tile_transitions.h"

#include "terrain/pyramid/make/tile_transition.h"

namespace tind::services {
namespace {

/// Both tiles, from the cache where they are there, then the way between them.
Result<TileProducts::Product> build(TileService& tiles, const ServedDataset& dataset, TileId tile,
                                    std::stop_token stop) {
  const auto fine = tiles.make_now(dataset, tile, dataset.offered, stop);
  if (!fine) return std::unexpected(fine.error());
  const auto parent = tiles.make_now(dataset, tile.parent(), dataset.offered, stop);
  if (!parent) return std::unexpected(parent.error());
  const auto made = tile_transition(tile, (*fine)->bytes(), (*parent)->bytes(), stop);
  if (!made) return fail(dataset.name, made.error());
  const std::vector<std::uint8_t> bytes = proto::encode(*made);
  return http::Representation::make(
      {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
      {.content_type = "application/vnd.tind.transition", .cache_control = "public, max-age=3600"});
}

}  // namespace

TileTransitions::TileTransitions(TileService& tiles, TileCache& cache, CpuPool& pool)
    : TileProducts(cache, pool, TileKey::kTransition,
                   [&tiles](const ServedDataset& dataset, TileId tile, std::stop_token stop) {
                     return build(tiles, dataset, tile, std::move(stop));
                   }) {}

}  // namespace tind::services
