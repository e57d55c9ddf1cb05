#include "server/services/tile_transitions.h"

#include "terrain/pyramid/tile_transition.h"

namespace tind::services {
namespace {

/// Both tiles, then the way between them.
Result<TileProducts::Product> build(const Dataset& dataset, TileId tile, std::stop_token stop) {
  const auto fine = dataset.tiles->tile(tile, stop);
  if (!fine) return fail(dataset.name + " " + tile.text(), fine.error());
  const auto parent = dataset.tiles->tile(tile.parent(), stop);
  if (!parent) return fail(dataset.name + " " + tile.parent().text(), parent.error());
  const auto made = tile_transition(tile, *fine, *parent);
  if (!made) return fail(dataset.name, made.error());
  const std::vector<std::uint8_t> bytes = proto::encode(*made);
  return http::Representation::make(
      {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
      {.content_type = "application/vnd.tind.transition", .cache_control = "public, max-age=3600"});
}

}  // namespace

TileTransitions::TileTransitions(TileCache& cache, CpuPool& pool)
    : TileProducts(cache, pool, TileKey::kTransition, build) {}

}  // namespace tind::services
