// A directory of tiles as a tile set: layer.json and z/x/y.terrain, plain or gzipped.

#include "terrain/pyramid/decoded_tile.h"
#include "terrain/pyramid/tile_location.h"
#include "terrain/pyramid/tileset.h"

namespace tind {

namespace {

class StoredTiles : public TileSet {
 public:
  StoredTiles(TileLocation location, proto::LayerJson layer)
      : location_(std::move(location)), layer_(std::move(layer)) {}

  const proto::LayerJson& layer() const override { return layer_; }
  bool available(TileId id) const override { return layer_.contains(id.level, id.x, id.y); }

  Result<TileBytes> tile(TileId id, std::stop_token) const override {
    if (!available(id)) return fail(Errc::not_found, "no tile " + id.text() + " in this dataset");
    const std::string path = location_.tile(id);
    auto bytes = location_.read(path);
    if (bytes && !gunzip(*bytes)) return fail(Errc::bad_data, path + ": damaged gzip data");
    if (!bytes) {
      // It is listed as available: that it is not there is the store's fault, not the client's.
      if (bytes.error().code == Errc::not_found) return fail(Errc::io, bytes.error().what);
      return std::unexpected(bytes.error());
    }
    const auto decoded = decode_tile(*bytes);
    if (!decoded) return fail(path, decoded.error());
    TileBytes tile;
    tile.bytes = std::move(*bytes);
    if (const auto& says = decoded->says) {
      tile.max_error_m = says->max_error_m, tile.edge_error_m = says->edge_error_m;
      tile.exact = says->exact, tile.side = says->side;
    }
    return tile;
  }
  const DemSource* dem() const override { return nullptr; }

 private:
  TileLocation location_;
  proto::LayerJson layer_;
};

}  // namespace

Result<std::unique_ptr<TileSet>> open_stored_tiles(const std::string& directory) {
  TileLocation location(directory);
  const std::string path = location.file("layer.json");
  const auto bytes = location.read(path);
  if (!bytes) {
    return fail(bytes.error().code, path +
                                        " cannot be read: is this a directory made by tind build "
                                        "that was finished?");
  }
  std::string reason;
  auto layer = proto::decode_layer_json(
      {reinterpret_cast<const char*>(bytes->data()), bytes->size()}, reason);
  if (!layer) return fail(Errc::bad_data, path + ": " + reason);
  return std::make_unique<StoredTiles>(std::move(location), std::move(*layer));
}

}  // namespace tind
