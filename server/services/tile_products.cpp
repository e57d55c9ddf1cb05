#include "server/services/tile_products.h"

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
    land(made);
  }

 private:
  TileProducts* products_;
  const Dataset* dataset_;
  TileId tile_;

  Result<Product> build(std::stop_token stop) {
    // It may have landed while this one waited.
    if (Product found = products_->cached(*dataset_, tile_)) return found;
    Result<Product> made = products_->build_(*dataset_, tile_, std::move(stop));
    if (made)
      products_->cache_.insert({dataset_->index, tile_, products_->variant_}, *made);
    return made;
  }
  void land(const Result<Product>& made) {
    std::exchange(products_, nullptr)->flights_.land({dataset_->index, tile_}, made);
  }
};

void TileProducts::make(const Dataset& dataset, TileId tile, Done done) {
  const Address address{dataset.index, tile};
  if (!flights_.join(address, std::move(done))) return;
  auto permit = pool_.admit();
  if (!permit) return flights_.land(address, std::unexpected(permit.error()));
  pool_.run(std::move(*permit), Flight(*this, dataset, tile));
}

}  // namespace tind::services
