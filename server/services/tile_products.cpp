#include "server/services/tile_products.h"

#include <chrono>
#include <exception>

namespace tind::services {

/// Goes with the task: whatever happens to it, those who wait are told.
class TileProducts::Flight {
 public:
  Flight(TileProducts& products, const Dataset& dataset, TileId tile)
      : products_(&products), dataset_(&dataset), tile_(tile) {}
  Flight(Flight&& other) noexcept
      : products_(std::exchange(other.products_, nullptr)),
        dataset_(other.dataset_),
        tile_(other.tile_) {}
  Flight& operator=(Flight&&) = delete;
  ~Flight() {
    if (products_) land(fail(Errc::cancelled, "the server is shutting down"));
  }

  void operator()(std::stop_token stop) {
    Result<Product> made = fail(Errc::internal, "not built");
    try {
      made = products_->make_now(*dataset_, tile_, std::move(stop));
    } catch (const std::exception& error) {
      made = fail(Errc::internal, error.what());
    }
    if (!made) products_->counters_.failed.fetch_add(1, std::memory_order_relaxed);
    land(made);
  }

 private:
  TileProducts* products_;
  const Dataset* dataset_;
  TileId tile_;

  void land(const Result<Product>& made) {
    std::exchange(products_, nullptr)->flights_.land({dataset_->index, tile_}, made);
  }
};

Result<TileProducts::Product> TileProducts::make_now(const Dataset& dataset, TileId tile,
                                                     std::stop_token stop) {
  const TileKey key{dataset.index, tile, variant_};
  // It may have landed while this one waited.
  if (Product found = cache_.find(key)) return found;
  const auto begin = std::chrono::steady_clock::now();
  Result<Product> made = build_(dataset, tile, std::move(stop));
  if (!made) return made;
  cache_.insert(key, *made);
  const auto took = std::chrono::steady_clock::now() - begin;
  counters_.built.fetch_add(1, std::memory_order_relaxed);
  counters_.build_nanoseconds.fetch_add(std::uint64_t(std::chrono::nanoseconds(took).count()),
                                        std::memory_order_relaxed);
  return made;
}

TileProducts::Product TileProducts::cached(const Dataset& dataset, TileId tile,
                                           std::uint8_t variant) {
  Product found = cache_.find({dataset.index, tile, variant});
  if (found) counters_.hits.fetch_add(1, std::memory_order_relaxed);
  return found;
}

void TileProducts::make(const Dataset& dataset, TileId tile, Done done) {
  const Address address{dataset.index, tile};
  if (!flights_.join(address, std::move(done))) {
    counters_.joined.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  auto permit = pool_.admit();
  if (!permit) {
    counters_.refused.fetch_add(1, std::memory_order_relaxed);
    return flights_.land(address, std::unexpected(permit.error()));
  }
  pool_.run(std::move(*permit), Flight(*this, dataset, tile));
}

}  // namespace tind::services
