#pragma once
// From a tile's address to its bytes, with the extensions that were asked for. Tiles are built
// whole, once however many ask for whichever extensions; the others are taken from that.

#include <cstdint>
#include <stop_token>

#include "proto/tile/quantized_mesh.h"
#include "server/http/message/request.h"
#include "server/services/datasets/catalog.h"
#include "server/services/tiles/tile_cache.h"
#include "server/services/tiles/tile_products.h"
#include "server/services/work/cpu_pool.h"
#include "terrain/base/result.h"

namespace tind::services {

class TileService {
 public:
  using Tile = TileCache::Tile;
  using Done = TileProducts::Done;

  /// Both must outlive the service.
  TileService(TileCache& cache, CpuPool& pool,
              std::chrono::milliseconds failure_age = TileProducts::kFailureAge);
  /// Stops the pool, because its tasks work on this object.
  ~TileService() { pool_.stop(); }
  TileService(const TileService&) = delete;
  TileService& operator=(const TileService&) = delete;

  /// The tile with the extensions that were asked for and that the dataset has; null when it is not
  /// in the cache. Cheap: for I/O threads.
  Tile cached(const ServedDataset&, TileId, proto::Extensions);

  /// The same for one who only wants to know: neither counted nor taken for a use. Null when the
  /// tile is not in the cache with these extensions.
  Tile peek(const ServedDataset&, TileId, proto::Extensions) const;

  /// Calls `done` once: from a worker when the tile is there or could not be made, or at once, from
  /// this thread, with Errc::busy or the failure of a moment ago.
  /// REQUIRES: dataset.tiles->available(tile).
  void make(const ServedDataset&, TileId, proto::Extensions, Done done, http::Asker asker = {});

  /// The same for one who is on a worker already and wants several: from the cache, or made here.
  /// REQUIRES: dataset.tiles->available(tile).
  Result<Tile> make_now(const ServedDataset&, TileId, proto::Extensions, std::stop_token);

  /// Of whole tiles, except that hits count every variant.
  const TileProducts::Counters& counters() const { return whole_.counters(); }

 private:
  /// Taken from the whole tile, which has all extensions.
  Result<Tile> variant_of(const ServedDataset&, TileId, const Tile& whole, std::uint8_t variant);

  TileCache& cache_;
  CpuPool& pool_;
  TileProducts whole_;
};

}  // namespace tind::services
