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
TileProducts::Build build_with(TileService& tiles, std::string_view type, Make make) {
  return [&tiles, type, make](const ServedDataset& dataset, TileId id,
                              std::stop_token stop) -> Result<TileProducts::Product> {
    const tiles3d::Source source{
        *dataset.tiles, [&](TileId tile) { return finished_model(tiles, dataset, tile, stop); }};
    const auto made = make(source, id);
    if (!made) return std::unexpected(made.error());
    if constexpr (requires { std::string_view(*made); })
      return represent(*made, type);
    else
      return represent(text_of(*made), type);
  };
}

}  // namespace

Tiles3d::Tiles3d(TileService& tiles, TileCache& cache, CpuPool& pool)
    : contents(cache, pool, TileKey::kContent3d,
               build_with(tiles, "model/gltf-binary",
                          [](const tiles3d::Source& source, TileId id) {
                            return tiles3d::content(source, id);
                          })),
      subtrees(cache, pool, TileKey::kSubtree3d,
               build_with(tiles, "application/octet-stream",
                          [](const tiles3d::Source& source, TileId id) {
                            return tiles3d::subtree(source, id);
                          })),
      tilesets(cache, pool, TileKey::kTileset3d,
               build_with(tiles, "application/json", [](const tiles3d::Source& source, TileId) {
                 return tiles3d::tileset_json(source);
               })) {}

}  // namespace tind::services
