#include "server/services/tiles/tile_products.h"

#include <chrono>
#include <exception>

#include "terrain/base/caught.h"

namespace tind::services {

namespace {

constexpr std::size_t kMostFailures = 4096;  // remembered

/// Of the source or of the program; not of the moment.
bool will_fail_again(Errc code) {
  return code == Errc::bad_data || code == Errc::io || code == Errc::unsupported ||
         code == Errc::internal;
}

}  // namespace

/// Whatever happens to it, those who wait are told.
class TileProducts::Task {
 public:
  Task(TileProducts& products, const ServedDataset& dataset, TileId tile, std::uint32_t detail,
       Flights::Ticket ticket)
      : products_(&products),
        dataset_(dataset.shared_from_this()),
        tile_(tile),
        detail_(detail),
        ticket_(std::move(ticket)) {}
  Task(Task&& other) noexcept
      : products_(std::exchange(other.products_, nullptr)),
        dataset_(std::move(other.dataset_)),
        tile_(other.tile_),
        detail_(other.detail_),
        ticket_(std::move(other.ticket_)) {}
  Task& operator=(Task&&) = delete;
  ~Task() {
    if (products_) land(fail(Errc::cancelled, "the server is shutting down"));
  }

  void operator()(std::stop_token stop) {
    land(products_->make_now(*dataset_, tile_, std::move(stop), detail_));
  }

 private:
  TileProducts* products_;
  std::shared_ptr<const ServedDataset> dataset_;  // it may be another by that name meanwhile
  TileId tile_;
  std::uint32_t detail_;
  Flights::Ticket ticket_;

  void land(const Result<Product>& made) {
    std::exchange(products_, nullptr)->flights_.land(ticket_, made);
  }
};

Result<TileProducts::Product> TileProducts::make_now(const ServedDataset& dataset, TileId tile,
                                                     std::stop_token stop, std::uint32_t detail) {
  const TileKey key{dataset.index, tile, variant_, detail};
  const Address address{dataset.index, tile, detail};
  // It may have landed while this one waited.
  if (Product found = cache_.find(key)) return found;
  if (const auto failure = recent_failure(address)) return std::unexpected(*failure);
  const auto begin = std::chrono::steady_clock::now();
  Result<Product> made = fail(Errc::internal, "not built");
  try {
    made = build_(dataset, tile, detail, std::move(stop));
  } catch (const std::exception& error) {
    made = fail(dataset.name + " " + tile.text(), caught(error));
  }
  if (!made) {
    if (will_fail_again(made.error().code)) remember_failure(address, made.error());
    return made;
  }
  cache_.insert(key, *made);
  const auto took = std::chrono::steady_clock::now() - begin;
  counters_.built.fetch_add(1, std::memory_order_relaxed);
  counters_.build_nanoseconds.fetch_add(std::uint64_t(std::chrono::nanoseconds(took).count()),
                                        std::memory_order_relaxed);
  return made;
}

std::optional<Error> TileProducts::recent_failure(const Address& address) {
  const std::lock_guard lock(failures_mutex_);
  const auto found = failures_.find(address);
  if (found == failures_.end()) return {};
  if (found->second.until < std::chrono::steady_clock::now()) {
    failures_.erase(found);
    return {};
  }
  counters_.failed_again.fetch_add(1, std::memory_order_relaxed);
  return found->second.error;
}

void TileProducts::remember_failure(const Address& address, const Error& error) {
  counters_.failed.fetch_add(1, std::memory_order_relaxed);
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard lock(failures_mutex_);
  if (failures_.size() >= kMostFailures)
    std::erase_if(failures_, [&](const auto& failure) { return failure.second.until < now; });
  if (failures_.size() < kMostFailures)
    failures_.insert_or_assign(address, Failure{error, now + failure_age_});
}

TileProducts::Product TileProducts::cached(const ServedDataset& dataset, TileId tile,
                                           std::uint8_t variant, std::uint32_t detail) {
  Product found = cache_.find({dataset.index, tile, variant, detail});
  if (found) counters_.hits.fetch_add(1, std::memory_order_relaxed);
  return found;
}

void TileProducts::make_detailed(const ServedDataset& dataset, TileId tile, std::uint32_t detail,
                                 Done done, http::Asker asker) {
  const Address address{dataset.index, tile, detail};
  if (const auto failure = recent_failure(address)) return done(std::unexpected(*failure));
  const auto ticket = flights_.join(address, std::move(done), std::move(asker.gone));
  if (!ticket) {
    counters_.joined.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  // What is made of a tile takes a core, wherever the tile comes from.
  const bool fetched = variant_ == TileKey::kWhole && dataset.tiles->fetched();
  auto permit = pool_.admit(fetched ? Work::fetch : Work::tile, asker.client);
  if (!permit) {
    counters_.refused.fetch_add(1, std::memory_order_relaxed);
    return flights_.land(ticket, std::unexpected(permit.error()));
  }
  pool_.run(std::move(*permit), Task(*this, dataset, tile, detail, ticket), ticket->abandoned());
}

}  // namespace tind::services
