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
      made = build(std::move(stop));
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

  Result<Product> build(std::stop_token stop) {
    const TileKey key{dataset_->index, tile_, products_->variant_};
    // It may have landed while this one waited.
    if (Product found = products_->cache_.find(key)) return found;
    const auto begin = std::chrono::steady_clock::now();
    Result<Product> made = products_->build_(*dataset_, tile_, std::move(stop));
    if (!made) return made;
    products_->cache_.insert(key, *made);
    const auto took = std::chrono::steady_clock::now() - begin;
    Counters& counters = products_->counters_;
    counters.built.fetch_add(1, std::memory_order_relaxed);
    counters.build_nanoseconds.fetch_add(std::uint64_t(std::chrono::nanoseconds(took).count()),
                                         std::memory_order_relaxed);
    return made;
  }
  void land(const Result<Product>& made) {
    std::exchange(products_, nullptr)->flights_.land({dataset_->index, tile_}, made);
  }
};

TileProducts::Product TileProducts::cached(const Dataset& dataset, TileId tile) {
  Product found = cache_.find({dataset.index, tile, variant_});
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
