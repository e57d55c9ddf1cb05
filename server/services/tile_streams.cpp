#include "server/services/tile_streams.h"

#include <exception>
#include <span>

#include "proto/mesh_stream.h"
#include "terrain/pyramid/tile_stream.h"

namespace tind::services {
namespace {

/// What a tile's heights are above: a store does not say, and the format means the ellipsoid.
VerticalDatum datum_of(const Dataset& dataset) {
  const DemSource* const dem = dataset.tiles->dem();
  return dem ? dem->info().datum : VerticalDatum::ellipsoid;
}

}  // namespace

/// Goes with the task: whatever happens to it, those who wait are told.
class TileStreams::Flight {
 public:
  Flight(TileStreams& streams, const Dataset& dataset, TileId tile)
      : streams_(&streams), dataset_(&dataset), tile_(tile) {}
  Flight(Flight&& other) noexcept
      : streams_(std::exchange(other.streams_, nullptr)),
        dataset_(other.dataset_),
        tile_(other.tile_) {}
  Flight& operator=(Flight&&) = delete;
  ~Flight() {
    if (streams_) land(fail(Errc::cancelled, "the server is shutting down"));
  }

  void operator()(std::stop_token stop) {
    Result<Stream> made = fail(Errc::internal, "not built");
    try {
      made = streams_->build(*dataset_, tile_, std::move(stop));
    } catch (const std::exception& error) {
      made = fail(Errc::internal, error.what());
    }
    land(made);
  }

 private:
  TileStreams* streams_;
  const Dataset* dataset_;
  TileId tile_;

  void land(const Result<Stream>& made) {
    std::exchange(streams_, nullptr)->flights_.land({dataset_->index, tile_}, made);
  }
};

void TileStreams::make(const Dataset& dataset, TileId tile, Done done) {
  const Address address{dataset.index, tile};
  if (!flights_.join(address, std::move(done))) return;
  auto permit = pool_.admit();
  if (!permit) return flights_.land(address, std::unexpected(permit.error()));
  pool_.run(std::move(*permit), Flight(*this, dataset, tile));
}

Result<TileStreams::Stream> TileStreams::build(const Dataset& dataset, TileId tile,
                                               std::stop_token stop) {
  if (Stream found = cached(dataset, tile)) return found;  // it landed while this one waited
  const auto whole = tiles_.make_now(dataset, tile, dataset.offered, stop);
  if (!whole) return std::unexpected(whole.error());
  const std::string_view body = (*whole)->body();
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(body.data()), body.size());
  const auto stream = tile_stream(tile, bytes, datum_of(dataset), std::move(stop));
  if (!stream) return fail(dataset.name, stream.error());
  const auto encoded = proto::encode(*stream);
  if (!encoded)
    return fail(Errc::internal, dataset.name + " " + tile.text() + ": " + encoded.error());
  Stream made =
      http::Representation::make({reinterpret_cast<const char*>(encoded->data()), encoded->size()},
                                 {.content_type = "application/vnd.tind.progressive-mesh",
                                  .cache_control = "public, max-age=3600",
                                  .vary = "",
                                  .compress = false,
                                  .ranges = true});
  cache_.insert({dataset.index, tile, TileKey::kStream}, made);
  return made;
}

}  // namespace tind::services
