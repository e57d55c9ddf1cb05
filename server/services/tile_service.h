#pragma once
// From a tile's address to its bytes: the cache, else one build however many ask, on the CPU pool,
// refused when the pool's queue is full. A failure goes to all who waited, and is not kept.

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "proto/quantized_mesh.h"
#include "server/services/catalog.h"
#include "server/services/cpu_pool.h"
#include "server/services/tile_cache.h"

namespace tind::services {

class TileService {
 public:
  using Tile = TileCache::Tile;
  using Done = std::move_only_function<void(Result<Tile>)>;

  /// Both must outlive the service.
  TileService(TileCache& cache, CpuPool& pool) : cache_(cache), pool_(pool) {}
  /// Stops the pool, because its tasks work on this object.
  ~TileService() { pool_.stop(); }
  TileService(const TileService&) = delete;
  TileService& operator=(const TileService&) = delete;

  /// The tile with the extensions that were asked for and that the dataset has; null when it is not
  /// in the cache. Cheap: for I/O threads.
  Tile cached(const Dataset&, TileId, proto::Extensions);

  /// Calls `done` once: from a worker when the tile is there or could not be made, or at once, from
  /// this thread, with Errc::busy. REQUIRES: dataset.tiles->available(tile).
  void make(const Dataset&, TileId, proto::Extensions, Done done);

  /// The same for one who is on a worker already and wants several: from the cache, or made here.
  /// REQUIRES: dataset.tiles->available(tile).
  Result<Tile> make_now(const Dataset&, TileId, proto::Extensions, std::stop_token);

  struct Counters {
    std::atomic<std::uint64_t> hits{0}, built{0}, joined{0}, failed{0}, refused{0};
    std::atomic<std::uint64_t> build_nanoseconds{0};
  };
  const Counters& counters() const { return counters_; }

 private:
  struct Waiter {
    std::uint8_t variant;
    Done done;
  };
  using Address = std::pair<std::uint32_t, TileId>;  // dataset, tile
  class Flight;

  void fly(const Dataset&, TileId, std::stop_token);
  Result<Tile> whole_tile(const Dataset&, TileId, std::stop_token);
  Result<Tile> variant_of(const Dataset&, TileId, const Tile& whole, std::uint8_t variant);
  void land(const Dataset&, TileId, const Result<Tile>& whole);

  TileCache& cache_;
  CpuPool& pool_;
  std::mutex mutex_;
  std::map<Address, std::vector<Waiter>> flights_;
  Counters counters_;
};

}  // namespace tind::services
