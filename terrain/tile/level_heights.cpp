#include "terrain/tile/level_heights.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "terrain/geo/longitude.h"
#include "terrain/mesh/triangle_locator.h"

namespace tind {
namespace {

/// The north edge of the globe belongs to the last tiles.
TileId tile_of(Geographic p, int level) {
  const double side = tiling::tile_degrees(level);
  const auto index = [&](double degrees, std::uint32_t count) {
    return std::uint32_t(std::clamp(degrees / side, 0.0, double(count - 1)));
  };
  return {level, index(p.lon + 180, tiling::columns(level)),
          index(p.lat + 90, tiling::rows(level))};
}

/// In the tile's lattice.
Vec2 place_in(TileId tile, Geographic p) {
  const GeoRect rect = tiling::rect(tile);
  return {(p.lon - rect.west) / rect.width() * kTileExtent,
          (p.lat - rect.south) / rect.height() * kTileExtent};
}

/// What a client of that level draws at a place; nothing where there is no tile.
std::optional<TileId> drawn_tile(const LevelTiles& tiles, Geographic place, int level) {
  for (TileId tile = tile_of(place, level);; tile = tile.parent()) {
    if (tiles.available(tile)) return tile;
    if (tile.level == 0) return {};
  }
}

}  // namespace

Result<std::vector<std::optional<LevelHeight>>> level_heights(const LevelTiles& tiles,
                                                              std::span<const Geographic> places,
                                                              int level,
                                                              const std::stop_token& stop) {
  std::vector<std::optional<LevelHeight>> out(places.size());
  std::vector<std::pair<TileId, std::size_t>> asked;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (const auto tile = drawn_tile(tiles, within_first_turn(places[i]), level))
      asked.emplace_back(*tile, i);
  std::ranges::sort(asked);
  for (std::size_t begin = 0; begin < asked.size();) {
    if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
    const TileId id = asked[begin].first;
    const auto model = tiles.tile(id, stop);
    if (!model) return std::unexpected(model.error());
    const TriangleLocator locator(model->mesh);
    const auto error = model->certificate ? std::optional(model->certificate->max_error_m)
                                          : std::optional<double>();
    for (; begin < asked.size() && asked[begin].first == id; ++begin) {
      const std::size_t i = asked[begin].second;
      if (const auto height = locator.height_at(place_in(id, within_first_turn(places[i]))))
        out[i] = LevelHeight{*height, id, error};
    }
  }
  return out;
}

}  // namespace tind
