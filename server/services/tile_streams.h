#pragma once
// Tiles as progressive meshes, for /progressive: from the cache that tiles are in, else made from
// the tile on the CPU pool, once however many ask.

#include <functional>
#include <stop_token>
#include <utility>

#include "server/services/catalog.h"
#include "server/services/cpu_pool.h"
#include "server/services/single_flight.h"
#include "server/services/tile_cache.h"
#include "server/services/tile_service.h"

namespace tind::services {

class TileStreams {
 public:
  using Stream = TileCache::Tile;
  using Done = std::move_only_function<void(Result<Stream>)>;

  /// All must outlive this; the pool must have stopped before this goes.
  TileStreams(TileService& tiles, TileCache& cache, CpuPool& pool)
      : tiles_(tiles), cache_(cache), pool_(pool) {}
  TileStreams(const TileStreams&) = delete;
  TileStreams& operator=(const TileStreams&) = delete;

  /// Null when it is not in the cache. Cheap: for I/O threads.
  Stream cached(const Dataset& dataset, TileId tile) {
    return cache_.find({dataset.index, tile, TileKey::kStream});
  }

  /// Calls `done` once: from a worker, or at once, from this thread, with Errc::busy. A failure
  /// goes to all who wait and is not kept. REQUIRES: dataset.tiles->available(tile).
  void make(const Dataset&, TileId, Done done);

 private:
  using Address = std::pair<std::uint32_t, TileId>;  // dataset, tile
  class Flight;

  Result<Stream> build(const Dataset&, TileId, std::stop_token);

  TileService& tiles_;
  TileCache& cache_;
  CpuPool& pool_;
  SingleFlight<Address, Stream> flights_;
};

}  // namespace tind::services
