#include "server/services/tiles/tile_streams.h"

#include "proto/stream/mesh_stream.h"
#include "terrain/pyramid/make/tile_stream.h"

namespace tind::services {
namespace {

/// What a tile's heights are above: a store does not say, and the format means the ellipsoid.
VerticalDatum datum_of(const ServedDataset& dataset) {
  return dataset.source ? dataset.source->info().datum : VerticalDatum::ellipsoid;
}

Result<TileProducts::Product> build(TileService& tiles, const ServedDataset& dataset, TileId tile,
                                    std::stop_token stop) {
  const auto whole = tiles.make_now(dataset, tile, dataset.offered, stop);
  if (!whole) return std::unexpected(whole.error());
  const auto stream = tile_stream(tile, (*whole)->bytes(), datum_of(dataset), std::move(stop));
  if (!stream) return fail(dataset.name, stream.error());
  const auto encoded = proto::encode(*stream);
  if (!encoded)
    return fail(Errc::internal, dataset.name + " " + tile.text() + ": " + encoded.error().what);
  return http::Representation::make(
      {reinterpret_cast<const char*>(encoded->data()), encoded->size()},
      {.content_type = "application/vnd.tind.progressive-mesh",
       .cache_control = "public, max-age=3600",
       .vary = "",
       .compress = false,
       .ranges = true});
}

}  // namespace

TileStreams::TileStreams(TileService& tiles, TileCache& cache, CpuPool& pool)
    : TileProducts(cache, pool, TileKey::kStream,
                   [&tiles](const ServedDataset& dataset, TileId tile, std::stop_token stop) {
                     return build(tiles, dataset, tile, std::move(stop));
                   }) {}

}  // namespace tind::services
