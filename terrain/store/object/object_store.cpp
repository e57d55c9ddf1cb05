#include "terrain/store/object/object_store.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "terrain/store/folder/folder_contents.h"
#include "terrain/store/folder/tile_ledger.h"
#include "terrain/store/object/object_names.h"

namespace tind {

namespace {

using Bytes = std::vector<std::uint8_t>;

std::string_view text_of(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class ObjectStore : public TileStore {
 public:
  ObjectStore(const std::string& url, const remote::Objects& objects)
      : base_(object_prefix(url)), objects_(objects) {}

  std::string name() const override { return base_; }
  std::string layer_name() const override { return base_ + folder::kLayer; }
  std::string tile_name(TileId id) const override { return folder::tile_path(base_, id); }
  bool remote() const override { return true; }

  Result<Bytes> layer_json() const override { return read_object(folder::kLayer); }
  Result<std::optional<BuildRecord>> record() const override {
    const auto bytes = read_object(folder::kRecord);
    return bytes ? decode_build_record(text_of(*bytes)) : without_record(bytes.error());
  }
  Result<std::string> kept_blocks() const override {
    const auto made = record();
    if (!made) return std::unexpected(made.error());
    if (!*made || (*made)->heights.empty()) return TileStore::kept_blocks();
    const auto bytes = read_object(folder::kBlocks + (*made)->heights);
    if (!bytes) return std::unexpected(bytes.error());
    return std::string(text_of(*bytes));
  }

  Result<Bytes> read(TileId) const override;
  Result<StoredTile> look_at(TileId) const override;
  Result<std::optional<StoreListing>> list() const override;

  std::optional<std::uint64_t> generation() const override {
    const auto known = ledger();
    if (!known) return {};
    return (*known)->record();
  }
  Result<void> vouched_for() const override {
    const auto known = ledger();
    if (known || known.error().code == Errc::not_found) return {};
    return std::unexpected(known.error());
  }
  Result<void> names_as_many(std::uint64_t listed) const override;
  std::vector<StoreFault> faults() const override;

 private:
  const std::string base_;
  const remote::Objects objects_;
  mutable std::mutex mutex_;
  mutable std::optional<Result<std::shared_ptr<const TileLedger>>> ledger_;

  Result<Bytes> read_object(const std::string& name) const {
    auto got = objects_.get(base_ + name, kLargestObject);
    if (!got) return std::unexpected(got.error());
    return std::move(got->bytes);
  }
  Result<std::shared_ptr<const TileLedger>> ledger() const;
  Result<void> check_same() const;
  Result<Bytes> damaged(TileId) const;
};

/// What is known once stays: a store gives tiles of one build. That a server did not answer is not
/// known for good.
Result<std::shared_ptr<const TileLedger>> ObjectStore::ledger() const {
  const std::lock_guard lock(mutex_);
  if (ledger_) return *ledger_;
  const auto bytes = read_object(folder::kLedger);
  if (!bytes && bytes.error().code != Errc::not_found) return std::unexpected(bytes.error());
  if (!bytes) return ledger_.emplace(std::unexpected(bytes.error()));
  auto found = TileLedger::of_bytes(text_of(*bytes), base_ + folder::kLedger);
  if (!found) return std::unexpected(found.error());
  return ledger_.emplace(std::make_shared<const TileLedger>(std::move(*found)));
}

/// Fails with busy where the ledger that lies there now is that of other tiles.
Result<void> ObjectStore::check_same() const {
  const auto bytes = read_object(folder::kLedger);
  if (!bytes) return std::unexpected(bytes.error());
  const auto now = TileLedger::of_bytes(text_of(*bytes), base_ + folder::kLedger);
  if (const auto known = ledger(); now && known && now->record() != (*known)->record())
    return fail(Errc::busy, base_ + " has got other tiles: ask again in a moment");
  return {};
}

/// The list may be that of an update that has just come.
Result<void> ObjectStore::names_as_many(std::uint64_t listed) const {
  const auto known = ledger();
  if (!known)
    return known.error().code == Errc::not_found ? Result<void>() : std::unexpected(known.error());
  auto same = (*known)->names_as_many(listed, layer_name());
  if (same) return same;
  const auto still = check_same();
  return still ? same : still;
}

/// Why a tile is other than the ledger says.
Result<Bytes> ObjectStore::damaged(TileId id) const {
  if (auto same = check_same(); !same) return std::unexpected(same.error());
  return fail(Errc::io, tile_name(id) +
                            " is not as the ledger beside it says: damaged, or changed "
                            "by something else than tind");
}

Result<Bytes> ObjectStore::read(TileId id) const {
  auto tile = look_at(id);
  if (!tile) return std::unexpected(tile.error());
  if (tile->vouched == Vouched::yes || tile->vouched == Vouched::by_nobody)
    return std::move(tile->bytes);
  return damaged(id);
}

Result<StoredTile> ObjectStore::look_at(TileId id) const {
  const auto known = ledger();
  if (!known && known.error().code != Errc::not_found) return std::unexpected(known.error());
  auto got = objects_.get(tile_name(id), kLargestStored);
  if (!got) return std::unexpected(got.error());
  StoredTile tile{std::move(got->bytes), Vouched::by_nobody};
  if (!known) return tile;
  const auto found = (*known)->find(id);
  if (!found) return std::unexpected(found.error());
  const std::optional<LedgerEntry>& entry = *found;
  tile.vouched = !entry                                    ? Vouched::not_listed
                 : entry->vouches_for(text_of(tile.bytes)) ? Vouched::yes
                                                           : Vouched::other_bytes;
  if (tile.vouched == Vouched::yes) tile.facts = entry->facts;
  return tile;
}

Result<std::optional<StoreListing>> ObjectStore::list() const {
  const auto objects = objects_.list(base_ + "/");
  if (!objects) return std::unexpected(objects.error());
  const auto made = record();
  if (!made) return std::unexpected(made.error());
  const std::string heights = *made ? (*made)->heights : std::string();
  StoreListing listing;
  for (const remote::ListedObject& object : *objects) {
    const std::filesystem::path path(object.key);
    if (const auto id = folder::tile_of_path(path)) {
      if (listing.levels.size() <= std::size_t(id->level)) listing.levels.resize(id->level + 1u);
      listing.levels[std::size_t(id->level)].push_back(*id);
    } else if (object.key.ends_with(folder::kTileSuffix)) {
      listing.strays.push_back(object.key);
    } else if (!is_object_of_build(object.key, heights)) {
      listing.others.push_back(object.key);
    }
  }
  for (auto& level : listing.levels) std::ranges::sort(level);
  return listing;
}

std::vector<StoreFault> ObjectStore::faults() const {
  const auto known = ledger();
  if (!known && known.error().code == Errc::not_found) return {};
  const std::string name = std::string(folder::kLedger).substr(1);
  const auto unread = [](const Error& error) {
    return error.code == Errc::io || error.code == Errc::busy;
  };
  if (!known) return {{StoreFault::In::ledger, name, known.error().what, unread(known.error())}};
  const auto text = read_object(folder::kRecord);
  if (text && (*known)->belongs_to(text_of(*text))) return {};
  return {{StoreFault::In::ledger, std::string(folder::kRecord).substr(1),
           text ? "is not the record that the ledger belongs to" : text.error().what,
           !text && unread(text.error())}};
}

}  // namespace

std::string object_prefix(std::string url) {
  if (url.ends_with(folder::kLayer)) url.resize(url.size() - 11);
  while (url.ends_with('/')) url.pop_back();
  return url;
}

std::unique_ptr<TileStore> object_store(const std::string& url, const remote::Objects& objects) {
  return std::make_unique<ObjectStore>(url, objects);
}

}  // namespace tind
