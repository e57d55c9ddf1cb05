#include "terrain/store/open/stored_tiles.h"

#include <memory>
#include <utility>

#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/store/open/open_store.h"
#include "terrain/store/tile_set.h"

namespace tind {

namespace {

class StoredTiles : public TileSet {
 public:
  StoredTiles(std::unique_ptr<TileStore> store, proto::LayerJson layer)
      : store_(std::move(store)), layer_(std::move(layer)) {}

  const proto::LayerJson& layer() const override { return layer_; }
  bool available(TileId id) const override { return layer_.contains(id.level, id.x, id.y); }

  Result<TileBytes> tile(TileId id, std::stop_token) const override {
    if (!available(id)) return fail(Errc::not_found, "no tile " + id.text() + " in this dataset");
    auto bytes = store_->read(id);
    if (bytes && !gunzip(*bytes))
      return fail(Errc::bad_data, store_->tile_name(id) + ": damaged gzip data");
    if (!bytes) {
      // It is listed as available: that it is not there is the store's fault, not the client's.
      if (bytes.error().code == Errc::not_found) return fail(Errc::io, bytes.error().what);
      return std::unexpected(bytes.error());
    }
    const auto decoded = decode_tile(id, *bytes);
    if (!decoded) return fail(store_->tile_name(id), decoded.error());
    TileBytes tile;
    tile.bytes = std::move(*bytes);
    if (const auto& says = decoded->certificate) {
      tile.max_error_m = says->max_error_m, tile.edge_error_m = says->edge_error_m;
      tile.exact = says->exact, tile.side = says->side;
    }
    return tile;
  }

  bool fetched() const override { return store_->remote(); }

 private:
  const std::unique_ptr<TileStore> store_;
  proto::LayerJson layer_;
};

}  // namespace

std::optional<std::uint64_t> stored_generation(const std::string& location) {
  return open_store(location)->generation();
}

Result<std::unique_ptr<TileSet>> open_stored_tiles(const std::string& location) {
  auto store = open_store(location);
  const std::string path = store->layer_name();
  const auto bytes = store->layer_json();
  if (!bytes && bytes.error().code == Errc::not_found && !store->remote() &&
      !names_archive(location))
    return fail(Errc::not_found, path +
                                     " cannot be read: is this a directory made by tind build "
                                     "that was finished?");
  if (!bytes) return std::unexpected(bytes.error());
  auto layer =
      proto::decode_layer_json({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!layer) return fail(path, layer.error());
  if (auto sure = store->vouched_for(); !sure) return std::unexpected(sure.error());
  return std::make_unique<StoredTiles>(std::move(store), std::move(*layer));
}

}  // namespace tind
