#include "server/services/tiles/tile_service.h"

#include <span>
#include <utility>

namespace tind::services {
namespace {

/// Bits of TileKey::variant: 1 where it carries an extension, or where the dataset has none to
/// leave out.
std::uint8_t variant_bits(const proto::Extensions& asked, const proto::Extensions& offered) {
  return std::uint8_t((asked.normals || !offered.normals ? 1 : 0) |
                      (asked.water_mask || !offered.water_mask ? 2 : 0) |
                      (asked.metadata || !offered.metadata ? 4 : 0));
}

static_assert(TileKey::kWhole == (1 | 2 | 4));

proto::Extensions extensions_of(std::uint8_t variant) {
  return {(variant & 1) != 0, (variant & 2) != 0, (variant & 4) != 0};
}

TileService::Tile represent(std::span<const std::uint8_t> bytes) {
  return http::Representation::make({reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                                    {.content_type = "application/vnd.quantized-mesh",
                                     .cache_control = "public, max-age=3600",
                                     .vary = "Accept, Accept-Encoding"});
}

Result<TileService::Tile> build(const ServedDataset& dataset, TileId tile, std::stop_token stop) {
  const auto made = dataset.tiles->tile(tile, std::move(stop));
  if (!made) return fail(dataset.name + " " + tile.text(), made.error());
  return represent(made->bytes);
}

}  // namespace

TileService::TileService(TileCache& cache, CpuPool& pool, std::chrono::milliseconds failure_age)
    : cache_(cache), pool_(pool), whole_(cache, pool, TileKey::kWhole, build, failure_age) {}

TileService::Tile TileService::cached(const ServedDataset& dataset, TileId tile,
                                      proto::Extensions asked) {
  return whole_.cached(dataset, tile, variant_bits(asked, dataset.offered));
}

TileService::Tile TileService::peek(const ServedDataset& dataset, TileId tile,
                                    proto::Extensions asked) const {
  return cache_.peek({dataset.index, tile, variant_bits(asked, dataset.offered)});
}

void TileService::make(const ServedDataset& dataset, TileId tile, proto::Extensions asked,
                       Done done, http::Asker asker) {
  const std::uint8_t variant = variant_bits(asked, dataset.offered);
  whole_.make(
      dataset, tile,
      [this, &dataset, tile, variant, done = std::move(done)](Result<Tile> whole) mutable {
        done(whole ? variant_of(dataset, tile, *whole, variant) : std::move(whole));
      },
      std::move(asker));
}

Result<TileService::Tile> TileService::make_now(const ServedDataset& dataset, TileId tile,
                                                proto::Extensions asked, std::stop_token stop) {
  if (Tile found = cached(dataset, tile, asked)) return found;
  Result<Tile> whole = whole_.make_now(dataset, tile, std::move(stop));
  if (!whole) return whole;
  return variant_of(dataset, tile, *whole, variant_bits(asked, dataset.offered));
}

Result<TileService::Tile> TileService::variant_of(const ServedDataset& dataset, TileId tile,
                                                  const Tile& whole, std::uint8_t variant) {
  if (variant == TileKey::kWhole) return whole;
  const TileKey key{dataset.index, tile, variant};
  if (Tile found = cache_.find(key)) return found;
  Tile made = represent(proto::strip_extensions(whole->bytes(), extensions_of(variant)));
  cache_.insert(key, made);
  return made;
}

}  // namespace tind::services
