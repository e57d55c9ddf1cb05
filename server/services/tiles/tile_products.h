#pragma once
// What is made of a tile and sent like one: from the cache that tiles are in, else made on the CPU
// pool, once however many ask, and not to the end where all of them have gone. What cannot be made
// is not tried again at once.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <tuple>
#include <utility>

#include "server/http/message/request.h"
#include "server/services/datasets/catalog.h"
#include "server/services/tiles/tile_cache.h"
#include "server/services/work/cpu_pool.h"
#include "server/services/work/single_flight.h"
#include "terrain/base/result.h"

namespace tind::services {

class TileProducts {
 public:
  using Product = TileCache::Tile;
  using Done = std::move_only_function<void(Result<Product>)>;
  /// On a worker.
  using Build = std::function<Result<Product>(const ServedDataset&, TileId, std::stop_token)>;
  /// The same where a number says what else was asked of the tile.
  using DetailedBuild =
      std::function<Result<Product>(const ServedDataset&, TileId, std::uint32_t, std::stop_token)>;

  /// For so long a source that failed is not asked for the same tile again.
  static constexpr std::chrono::milliseconds kFailureAge{2000};

  /// `variant` of TileKey is this product's own. All must outlive this; the pool must have stopped
  /// before this goes.
  TileProducts(TileCache& cache, CpuPool& pool, std::uint8_t variant, Build build,
               std::chrono::milliseconds failure_age = kFailureAge)
      : TileProducts(
            cache, pool, variant,
            DetailedBuild([make = std::move(build)](const ServedDataset& dataset, TileId tile,
                                                    std::uint32_t, std::stop_token stop) {
              return make(dataset, tile, std::move(stop));
            }),
            failure_age) {}
  TileProducts(TileCache& cache, CpuPool& pool, std::uint8_t variant, DetailedBuild build,
               std::chrono::milliseconds failure_age = kFailureAge)
      : cache_(cache),
        pool_(pool),
        variant_(variant),
        build_(std::move(build)),
        failure_age_(failure_age) {}
  TileProducts(const TileProducts&) = delete;
  TileProducts& operator=(const TileProducts&) = delete;

  /// Null when it is not in the cache. Cheap: for I/O threads.
  Product cached(const ServedDataset& dataset, TileId tile) {
    return cached(dataset, tile, variant_);
  }
  /// The same, for what is made of the product and kept under a variant of its own.
  Product cached(const ServedDataset&, TileId, std::uint8_t variant, std::uint32_t detail = 0);
  Product cached_detailed(const ServedDataset& dataset, TileId tile, std::uint32_t detail) {
    return cached(dataset, tile, variant_, detail);
  }

  /// Calls `done` once: from a worker, or at once, from this thread, with Errc::busy or the failure
  /// of a moment ago.
  /// REQUIRES: dataset.tiles->available(tile).
  void make(const ServedDataset& dataset, TileId tile, Done done, http::Asker asker = {}) {
    make_detailed(dataset, tile, 0, std::move(done), std::move(asker));
  }
  void make_detailed(const ServedDataset&, TileId, std::uint32_t detail, Done done,
                     http::Asker asker = {});

  /// For one who is on a worker already: from the cache, or built here.
  /// REQUIRES: dataset.tiles->available(tile).
  Result<Product> make_now(const ServedDataset&, TileId, std::stop_token, std::uint32_t detail = 0);

  struct Counters {
    std::atomic<std::uint64_t> hits{0}, joined{0}, refused{0}, built{0}, failed{0};
    std::atomic<std::uint64_t> failed_again{0};       // answered with the failure of a moment ago
    std::atomic<std::uint64_t> build_nanoseconds{0};  // with its tiles, where they were not there
  };
  const Counters& counters() const { return counters_; }

 private:
  using Address = std::tuple<std::uint32_t, TileId, std::uint32_t>;  // dataset, tile, detail
  using Flights = SingleFlight<Address, Product>;
  class Task;
  struct Failure {
    Error error;
    std::chrono::steady_clock::time_point until;
  };

  std::optional<Error> recent_failure(const Address&);
  void remember_failure(const Address&, const Error&);

  TileCache& cache_;
  CpuPool& pool_;
  const std::uint8_t variant_;
  const DetailedBuild build_;
  const std::chrono::milliseconds failure_age_;
  Flights flights_;
  std::mutex failures_mutex_;
  std::map<Address, Failure> failures_;
  Counters counters_;
};

}  // namespace tind::services
