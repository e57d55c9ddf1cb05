// A directory of tiles as a tile set: layer.json and z/x/y.terrain, plain or gzipped. Where a
// ledger lies beside them, each tile is held against it as it is read, and a set never gives tiles
// of another record than it was opened with: who wants those opens it anew. An update that is whole
// but still moves in is read where its files are, so that there is no time between.

#include "terrain/store/open/stored_tiles.h"

#include <filesystem>
#include <memory>
#include <mutex>

#include "proto/file_io.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/store/folder/folder_contents.h"
#include "terrain/store/folder/tile_ledger.h"
#include "terrain/store/tile_location.h"
#include "terrain/store/tile_set.h"

namespace tind {

namespace {

/// The ledger that counts, and whether an update's files still move in.
struct InForce {
  std::optional<TileLedger> ledger;
  bool moving = false;
  std::optional<Error> damaged;  // the folder's own, where no update's counts
};

InForce in_force(const std::string& base) {
  InForce now;
  const std::string ready = base + folder::kReady;
  auto own = TileLedger::open(base + folder::kLedger);
  if (folder::type_of(ready) == std::filesystem::file_type::directory) {
    if (const auto record = proto::read_whole_file(ready + folder::kRecord)) {
      auto moving = TileLedger::open(ready + folder::kLedger);
      if (!moving) moving = TileLedger::open(base + folder::kLedger);  // it has just moved
      if (moving && moving->belongs_to(*record)) {
        now.ledger = std::move(*moving), now.moving = true;
        return now;
      }
    }
    own = TileLedger::open(base + folder::kLedger);  // the record may have just moved, too
  }
  if (own)
    now.ledger = std::move(*own);
  else if (own.error().code != Errc::not_found)
    now.damaged = own.error();
  return now;
}

class StoredTiles : public TileSet {
 public:
  StoredTiles(TileLocation location, proto::LayerJson layer,
              std::shared_ptr<const TileLedger> ledger)
      : location_(std::move(location)), layer_(std::move(layer)), ledger_(std::move(ledger)) {}

  const proto::LayerJson& layer() const override { return layer_; }
  bool available(TileId id) const override { return layer_.contains(id.level, id.x, id.y); }

  Result<TileBytes> tile(TileId id, std::stop_token) const override {
    if (!available(id)) return fail(Errc::not_found, "no tile " + id.text() + " in this dataset");
    const std::string path = location_.tile(id);
    auto bytes = location_.read(path);
    if (const auto known = ledger(); known && !(bytes && vouches(*known, id, *bytes)))
      bytes = look_again(id, std::move(bytes));
    if (bytes && !gunzip(*bytes)) return fail(Errc::bad_data, path + ": damaged gzip data");
    if (!bytes) {
      // It is listed as available: that it is not there is the store's fault, not the client's.
      if (bytes.error().code == Errc::not_found) return fail(Errc::io, bytes.error().what);
      return std::unexpected(bytes.error());
    }
    const auto decoded = decode_tile(id, *bytes);
    if (!decoded) return fail(path, decoded.error());
    TileBytes tile;
    tile.bytes = std::move(*bytes);
    if (const auto& says = decoded->certificate) {
      tile.max_error_m = says->max_error_m, tile.edge_error_m = says->edge_error_m;
      tile.exact = says->exact, tile.side = says->side;
    }
    return tile;
  }
  const DemSource* dem() const override { return nullptr; }

 private:
  TileLocation location_;
  proto::LayerJson layer_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const TileLedger> ledger_;  // null: there was none

  std::shared_ptr<const TileLedger> ledger() const {
    const std::lock_guard lock(mutex_);
    return ledger_;
  }

  static bool vouches(const TileLedger& ledger, TileId id, const std::vector<std::uint8_t>& bytes) {
    const auto entry = ledger.find(id);
    return entry && entry->vouches_for({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }

  /// For a tile that is not as the ledger says: the folder may have got a new ledger of the same
  /// record, or the tile may be on its way.
  Result<std::vector<std::uint8_t>> look_again(TileId id,
                                               Result<std::vector<std::uint8_t>> found) const {
    const std::string path = location_.tile(id);
    auto now = in_force(location_.base());
    const auto known = ledger();
    if (now.ledger && now.ledger->record() != known->record())
      return fail(Errc::busy, location_.base() + " has got other tiles: ask again in a moment");
    auto newer = now.ledger ? std::make_shared<const TileLedger>(std::move(*now.ledger)) : known;
    const std::string ready = location_.base() + folder::kReady + "/" + id.text() + ".terrain";
    for (const std::string& place : {path, ready, path}) {
      auto bytes = location_.read(place);
      if (!bytes || !vouches(*newer, id, *bytes)) continue;
      const std::lock_guard lock(mutex_);
      ledger_ = newer;
      return bytes;
    }
    if (!found) return found;
    return fail(Errc::io, path +
                              " is not as the ledger beside it says: damaged, or changed by "
                              "something else than tind build, which makes it again");
  }
};

}  // namespace

std::optional<std::uint64_t> stored_generation(const std::string& directory) {
  const TileLocation location(directory);
  if (location.remote()) return {};
  const auto now = in_force(location.base());
  if (!now.ledger) return {};
  return now.ledger->record();
}

Result<std::unique_ptr<TileSet>> open_stored_tiles(const std::string& directory) {
  TileLocation location(directory);
  InForce now;
  if (!location.remote()) now = in_force(location.base());
  const std::string path = location.file("layer.json");
  auto bytes = location.read(now.moving ? location.base() + folder::kReady + folder::kLayer : path);
  if (!bytes && now.moving) bytes = location.read(path);
  if (!bytes) {
    return fail(bytes.error().code, path +
                                        " cannot be read: is this a directory made by tind build "
                                        "that was finished?");
  }
  std::string reason;
  auto layer = proto::decode_layer_json(
      {reinterpret_cast<const char*>(bytes->data()), bytes->size()}, reason);
  if (!layer) return fail(Errc::bad_data, path + ": " + reason);
  std::shared_ptr<const TileLedger> ledger;
  if (now.damaged) {
    return fail(now.damaged->code, now.damaged->what +
                                       ": tiles cannot be held against it; tind build makes it "
                                       "anew");
  }
  if (now.ledger) ledger = std::make_shared<const TileLedger>(std::move(*now.ledger));
  return std::make_unique<StoredTiles>(std::move(location), std::move(*layer), std::move(ledger));
}

}  // namespace tind
