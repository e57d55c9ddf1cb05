#include "server/services/tiles/tile_encodings.h"

#include "server/services/tiles/finished_model.h"

namespace tind::services {
namespace {

Result<TileProducts::Product> build(TileService& tiles, const TileEncoder& format,
                                    const ServedDataset& dataset, TileId tile,
                                    std::stop_token stop) {
  const auto model = finished_model(tiles, dataset, tile, std::move(stop));
  if (!model) return std::unexpected(model.error());
  const std::vector<std::uint8_t> bytes = format.encode(*model);
  return http::Representation::make(
      {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
      {.content_type = std::string(format.media_type), .cache_control = "public, max-age=3600"});
}

}  // namespace

TileEncodings::TileEncodings(TileService& tiles, TileCache& cache, CpuPool& pool) {
  std::uint8_t variant = TileKey::kEncodings;
  for (const TileEncoder& format : tile_encoders().subspan(1))
    all_.push_back({format, std::make_unique<TileProducts>(
                                cache, pool, variant++,
                                [&tiles, &format](const ServedDataset& dataset, TileId tile,
                                                  std::stop_token stop) {
                                  return build(tiles, format, dataset, tile, std::move(stop));
                                })});
}

}  // namespace tind::services
