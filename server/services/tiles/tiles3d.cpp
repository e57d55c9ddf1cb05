#include "server/services/tiles/tiles3d.h"

#include <string_view>

#include "server/services/tiles/finished_model.h"
#include "terrain/tiles3d/tileset.h"

namespace tind::services {
namespace {

TileProducts::Product represent(std::string_view body, std::string_view type) {
  return http::Representation::make(body, {.content_type = type});
}

std::string_view text_of(const std::vector<std::uint8_t>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// With whatever `make` makes of the dataset's tiles.
template <class Make>
TileProducts::Build build_with(TileService& tiles, GlbCompression compression,
                               std::string_view type, Make make) {
  return [&tiles, compression, type, make](const ServedDataset& dataset, TileId id,
                                           std::stop_token stop) -> Result<TileProducts::Product> {
    const tiles3d::Source source{
        *dataset.tiles, [&](TileId tile) { return finished_model(tiles, dataset, tile, stop); },
        compression, dataset.draped};
    const auto made = make(source, id);
    if (!made) return std::unexpected(made.error());
    if constexpr (requires { std::string_view(*made); })
      return represent(*made, type);
    else
      return represent(text_of(*made), type);
  };
}

std::uint8_t variant(std::uint8_t plain, GlbCompression compression) {
  return std::uint8_t(plain + (compression == GlbCompression::none ? 0 : TileKey::kMeshopt3d));
}

}  // namespace

Tileset3d::Tileset3d(TileService& tiles, TileCache& cache, CpuPool& pool,
                     GlbCompression compression)
    : contents(cache, pool, variant(TileKey::kContent3d, compression),
               build_with(tiles, compression, "model/gltf-binary",
                          [](const tiles3d::Source& source, TileId id) {
                            return tiles3d::content(source, id);
                          })),
      subtrees(cache, pool, variant(TileKey::kSubtree3d, compression),
               build_with(tiles, compression, "application/octet-stream",
                          [](const tiles3d::Source& source, TileId id) {
                            return tiles3d::subtree(source, id);
                          })),
      tilesets(cache, pool, variant(TileKey::kTileset3d, compression),
               build_with(tiles, compression, "application/json",
                          [](const tiles3d::Source& source, TileId) {
                            return tiles3d::tileset_json(source);
                          })) {}

Tiles3d::Tiles3d(TileService& tiles, TileCache& cache, CpuPool& pool)
    : plain(tiles, cache, pool, GlbCompression::none),
      meshopt(tiles, cache, pool, GlbCompression::meshopt) {}

}  // namespace tind::services
