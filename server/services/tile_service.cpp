#include "server/services/tile_service.h"

#include <chrono>
#include <exception>

namespace tind::services {
namespace {

/// Bits of TileKey::variant. What the dataset does not have is not told apart.
std::uint8_t variant_bits(const proto::Extensions& asked, const proto::Extensions& offered) {
  return std::uint8_t((asked.normals && offered.normals ? 1 : 0) |
                      (asked.water_mask && offered.water_mask ? 2 : 0) |
                      (asked.metadata && offered.metadata ? 4 : 0));
}

proto::Extensions extensions_of(std::uint8_t variant) {
  return {(variant & 1) != 0, (variant & 2) != 0, (variant & 4) != 0};
}

TileService::Tile represent(std::span<const std::uint8_t> bytes) {
  return http::Representation::make({reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                                    {.content_type = "application/vnd.quantized-mesh",
                                     .cache_control = "public, max-age=3600",
                                     .vary = "Accept, Accept-Encoding"});
}

}  // namespace

/// Goes with the task: whatever happens to it, those who wait are told.
class TileService::Flight {
 public:
  Flight(TileService& service, const Dataset& dataset, TileId tile)
      : service_(&service), dataset_(&dataset), tile_(tile) {}
  Flight(Flight&& other) noexcept
      : service_(std::exchange(other.service_, nullptr)),
        dataset_(other.dataset_),
        tile_(other.tile_) {}
  Flight& operator=(Flight&&) = delete;
  ~Flight() {
    if (service_)
      service_->land(*dataset_, tile_, fail(Errc::cancelled, "the server is shutting down"));
  }
  void operator()(std::stop_token stop) {
    std::exchange(service_, nullptr)->fly(*dataset_, tile_, stop);
  }

 private:
  TileService* service_;
  const Dataset* dataset_;
  TileId tile_;
};

TileService::Tile TileService::cached(const Dataset& dataset, TileId tile,
                                      proto::Extensions asked) {
  Tile found = cache_.find({dataset.index, tile, variant_bits(asked, dataset.offered)});
  if (found) counters_.hits.fetch_add(1, std::memory_order_relaxed);
  return found;
}

void TileService::make(const Dataset& dataset, TileId tile, proto::Extensions asked, Done done) {
  const std::uint8_t variant = variant_bits(asked, dataset.offered);
  const Address address{dataset.index, tile};
  std::unique_lock lock(mutex_);
  if (const auto flight = flights_.find(address); flight != flights_.end()) {
    flight->second.push_back({variant, std::move(done)});
    counters_.joined.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  auto permit = pool_.admit();
  if (!permit) {
    lock.unlock();
    counters_.refused.fetch_add(1, std::memory_order_relaxed);
    return done(std::unexpected(permit.error()));
  }
  flights_[address].push_back({variant, std::move(done)});
  lock.unlock();
  pool_.run(std::move(*permit), Flight(*this, dataset, tile));
}

Result<TileService::Tile> TileService::make_now(const Dataset& dataset, TileId tile,
                                                proto::Extensions asked, std::stop_token stop) {
  if (Tile found = cached(dataset, tile, asked)) return found;
  Result<Tile> whole = whole_tile(dataset, tile, stop);
  if (!whole) return whole;
  return variant_of(dataset, tile, *whole, variant_bits(asked, dataset.offered));
}

void TileService::fly(const Dataset& dataset, TileId tile, std::stop_token stop) {
  Result<Tile> whole = fail(Errc::internal, "not built");
  try {
    whole = whole_tile(dataset, tile, stop);
  } catch (const std::exception& error) {
    whole = fail(Errc::internal, error.what());
  }
  if (!whole) counters_.failed.fetch_add(1, std::memory_order_relaxed);
  land(dataset, tile, whole);
}

Result<TileService::Tile> TileService::whole_tile(const Dataset& dataset, TileId tile,
                                                  std::stop_token stop) {
  const TileKey key{dataset.index, tile, variant_bits(dataset.offered, dataset.offered)};
  if (Tile found = cache_.find(key)) return found;
  const auto begin = std::chrono::steady_clock::now();
  auto bytes = dataset.tiles->tile(tile, stop);
  if (!bytes) return fail(dataset.name + " " + tile.text(), bytes.error());
  Tile made = represent(bytes->bytes);
  cache_.insert(key, made);
  const auto took = std::chrono::steady_clock::now() - begin;
  counters_.built.fetch_add(1, std::memory_order_relaxed);
  counters_.build_nanoseconds.fetch_add(std::uint64_t(std::chrono::nanoseconds(took).count()),
                                        std::memory_order_relaxed);
  return made;
}

Result<TileService::Tile> TileService::variant_of(const Dataset& dataset, TileId tile,
                                                  const Tile& whole, std::uint8_t variant) {
  if (variant == variant_bits(dataset.offered, dataset.offered)) return whole;
  const TileKey key{dataset.index, tile, variant};
  if (Tile found = cache_.find(key)) return found;
  const std::string_view body = whole->body();
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(body.data()), body.size());
  Tile made = represent(proto::strip_extensions(bytes, extensions_of(variant)));
  cache_.insert(key, made);
  return made;
}

/// Answers all who wait, and those who join meanwhile, until nobody is left; then the flight is
/// over.
void TileService::land(const Dataset& dataset, TileId tile, const Result<Tile>& whole) {
  while (true) {
    std::vector<Waiter> waiters;
    {
      const std::lock_guard lock(mutex_);
      const auto flight = flights_.find({dataset.index, tile});
      waiters.swap(flight->second);
      if (waiters.empty()) {
        flights_.erase(flight);
        return;
      }
    }
    for (Waiter& waiter : waiters)
      waiter.done(whole ? variant_of(dataset, tile, *whole, waiter.variant) : whole);
  }
}

}  // namespace tind::services
