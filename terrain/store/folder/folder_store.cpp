// Where a ledger lies beside the tiles, each is held against it as it is read, and a store never
// gives tiles of another record than it was opened with. An update that is whole but still moves in
// is read where its files are, so that there is no time between.

#include "terrain/store/folder/folder_store.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <utility>

#include "terrain/base/file_io.h"
#include "terrain/raster/source_blocks.h"
#include "terrain/store/folder/folder_contents.h"
#include "terrain/store/folder/folder_lock.h"
#include "terrain/store/folder/tile_ledger.h"

namespace tind {

namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

std::string_view text_of(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string without_layer(std::string directory) {
  if (directory.ends_with(folder::kLayer)) directory.resize(directory.size() - 11);
  while (directory.size() > 1 && directory.ends_with('/')) directory.pop_back();
  return directory;
}

/// The ledger that counts, and whether an update's files still move in.
struct InForce {
  std::shared_ptr<const TileLedger> ledger;
  bool moving = false;
  std::optional<Error> damaged;  // the folder's own, where no update's counts
};

InForce in_force(const std::string& base) {
  InForce now;
  const std::string ready = base + folder::kReady;
  auto own = TileLedger::open(base + folder::kLedger);
  // Where that cannot be told, no update moves in: tiles are then held against the folder's ledger.
  if (const auto type = folder::type_of(ready); type && *type == fs::file_type::directory) {
    if (const auto record = read_regular_file(ready + folder::kRecord)) {
      auto moving = TileLedger::open(ready + folder::kLedger);
      if (!moving) moving = TileLedger::open(base + folder::kLedger);  // it has just moved
      if (moving && moving->belongs_to(*record)) {
        now.ledger = std::make_shared<const TileLedger>(std::move(*moving));
        now.moving = true;
        return now;
      }
    }
    own = TileLedger::open(base + folder::kLedger);  // the record may have just moved, too
  }
  if (own)
    now.ledger = std::make_shared<const TileLedger>(std::move(*own));
  else if (own.error().code != Errc::not_found)
    now.damaged = own.error();
  return now;
}

Result<bool> vouches(const TileLedger& ledger, TileId id, const Bytes& bytes) {
  const auto entry = ledger.find(id);
  if (!entry) return std::unexpected(entry.error());
  return *entry && (*entry)->vouches_for(text_of(bytes));
}

class FolderStore : public TileStore {
 public:
  explicit FolderStore(const std::string& directory) : base_(without_layer(directory)) {
    auto now = in_force(base_);
    moving_ = now.moving;
    damaged_ = std::move(now.damaged);
    ledger_ = std::move(now.ledger);
  }

  std::string name() const override { return base_; }
  std::string layer_name() const override { return base_ + folder::kLayer; }
  std::string tile_name(TileId id) const override { return folder::tile_path(base_, id); }
  bool remote() const override { return false; }

  Result<Bytes> layer_json() const override;
  Result<std::optional<BuildRecord>> record() const override {
    const auto bytes = record_text();
    return bytes ? decode_build_record(text_of(*bytes)) : without_record(bytes.error());
  }

  Result<std::string> kept_blocks() const override {
    const auto made = record();
    if (!made) return std::unexpected(made.error());
    if (!*made || (*made)->heights.empty()) return TileStore::kept_blocks();
    if (moving_)
      if (auto blocks = tind::kept_blocks(base_ + folder::kReady, **made)) return blocks;
    return tind::kept_blocks(base_, **made);
  }

  Result<Bytes> read(TileId id) const override {
    auto bytes = read_stored_file(tile_name(id));
    const auto known = ledger();
    if (!known) return bytes;
    const auto sound = bytes ? vouches(*known, id, *bytes) : false;
    if (!sound) return std::unexpected(sound.error());
    if (*sound) return bytes;
    return look_again(id, std::move(bytes));
  }
  Result<StoredTile> look_at(TileId id) const override;
  Result<std::optional<std::uint64_t>> size(TileId id) const override {
    const std::string path = tile_name(id);
    std::error_code error;
    const auto size = fs::file_size(path, error);
    if (!error) return size;
    if (const auto type = folder::type_of(path); type && *type == fs::file_type::not_found)
      return std::nullopt;
    return folder::cannot_look(path, error);
  }
  Result<std::optional<StoreListing>> list() const override;

  std::optional<std::uint64_t> generation() const override {
    const auto known = ledger();
    if (!known) return {};
    return known->record();
  }
  Result<void> vouched_for() const override {
    if (!damaged_) return {};
    return fail(damaged_->code,
                damaged_->what + ": tiles cannot be held against it" +
                    (damaged_->code == Errc::io ? "" : "; tind build makes it anew"));
  }
  Result<void> names_as_many(std::uint64_t listed) const override;
  std::vector<StoreFault> faults() const override;

 private:
  const std::string base_;
  bool moving_ = false;
  std::optional<Error> damaged_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const TileLedger> ledger_;  // null: there was none

  std::shared_ptr<const TileLedger> ledger() const {
    const std::lock_guard lock(mutex_);
    return ledger_;
  }
  Result<void> check_same(const InForce& now, const TileLedger& known) const;
  Result<Bytes> look_again(TileId, Result<Bytes> found) const;
  Result<Bytes> unless_built(Result<Bytes> found) const;
  Result<Bytes> read_beside(const std::string& name) const;
  Result<Bytes> record_text() const;
};

/// A file beside the tiles: where an update has it, as long as that moves in.
Result<Bytes> FolderStore::read_beside(const std::string& name) const {
  if (moving_)
    if (auto bytes = read_stored_file(base_ + folder::kReady + name)) return bytes;
  return read_stored_file(base_ + name);
}

/// What is not there while somebody builds here may come yet, or has made room for other tiles:
/// busy.
Result<Bytes> FolderStore::unless_built(Result<Bytes> found) const {
  if (found || found.error().code != Errc::not_found) return found;
  if (auto nobody = FolderLock::nobody_has(base_); !nobody) return std::unexpected(nobody.error());
  return found;
}

Result<Bytes> FolderStore::layer_json() const {
  auto found = unless_built(read_beside(folder::kLayer));
  if (found || found.error().code != Errc::not_found) return found;
  return read_beside(folder::kLayer);  // it may have come just before its build ended
}

/// Fails with busy where the folder has got another record since this was opened.
Result<void> FolderStore::check_same(const InForce& now, const TileLedger& known) const {
  if (!now.ledger || now.ledger->record() == known.record()) return {};
  return fail(Errc::busy, base_ + " has got other tiles: ask again in a moment");
}

/// Another record says nothing of these tiles.
Result<Bytes> FolderStore::record_text() const {
  auto bytes = read_beside(folder::kRecord);
  const auto known = ledger();
  if (!bytes || !known || known->belongs_to(text_of(*bytes))) return bytes;
  if (auto same = check_same(in_force(base_), *known); !same) return std::unexpected(same.error());
  return bytes;  // damaged, or changed by somebody else: faults() says so
}

/// For a tile that is not as the ledger says: the folder may have got a new ledger of the same
/// record, or the tile may be on its way.
Result<Bytes> FolderStore::look_again(TileId id, Result<Bytes> found) const {
  const std::string path = tile_name(id);
  const auto now = in_force(base_);
  const auto known = ledger();
  if (auto same = check_same(now, *known); !same) return std::unexpected(same.error());
  const auto newer = now.ledger ? now.ledger : known;
  const std::string ready = folder::tile_path(base_ + folder::kReady, id);
  for (const std::string& place : {path, ready, path}) {
    auto bytes = read_stored_file(place);
    const auto sound = bytes ? vouches(*newer, id, *bytes) : false;
    if (!sound) return std::unexpected(sound.error());
    if (!*sound) continue;
    const std::lock_guard lock(mutex_);
    ledger_ = newer;
    return bytes;
  }
  if (!found) {
    const auto listed = newer->find(id);
    return listed && *listed ? unless_built(std::move(found)) : found;
  }
  return fail(Errc::io, path +
                            " is not as the ledger beside it says: damaged, or changed by "
                            "something else than tind build, which makes it again");
}

Result<StoredTile> FolderStore::look_at(TileId id) const {
  auto sound = read(id);
  if (!sound && sound.error().code == Errc::busy) return std::unexpected(sound.error());
  if (sound) {
    const auto known = ledger();
    StoredTile tile{std::move(*sound), known ? Vouched::yes : Vouched::by_nobody};
    if (!known) return tile;
    const auto entry = known->find(id);
    if (!entry) return std::unexpected(entry.error());
    if (*entry) tile.facts = (*entry)->facts;
    return tile;
  }
  auto bytes = read_stored_file(tile_name(id));
  if (!bytes) return std::unexpected(bytes.error());
  const auto known = ledger();
  if (!known) return StoredTile{std::move(*bytes), Vouched::by_nobody};
  const auto entry = known->find(id);
  if (!entry) return std::unexpected(entry.error());
  return StoredTile{std::move(*bytes), *entry ? Vouched::other_bytes : Vouched::not_listed};
}

/// The list may be that of an update that has just come.
Result<void> FolderStore::names_as_many(std::uint64_t listed) const {
  const auto known = ledger();
  auto same = known ? known->names_as_many(listed, layer_name()) : Result<void>();
  if (same) return same;
  const auto still = check_same(in_force(base_), *known);
  return still ? same : still;
}

Result<std::optional<StoreListing>> FolderStore::list() const {
  StoreListing listing;
  const auto made = record();
  if (!made) return std::unexpected(made.error());
  const std::string blocks = *made ? (*made)->heights : std::string();
  std::error_code error;
  fs::recursive_directory_iterator it(base_, error), end;
  if (error == std::errc::no_such_file_or_directory)
    return fail(Errc::not_found, "there is no folder " + base_);
  if (error) return folder::cannot_look(base_, error);
  std::string last = base_;  // into which it cannot look, where it fails
  for (; it != end; it.increment(error)) {
    last = it->path().string();
    std::error_code none;  // of one that went away meanwhile
    const fs::path relative = it->path().lexically_relative(base_);
    if (("/" + relative.string()).starts_with(folder::kAside) && it->is_directory(none))
      it.disable_recursion_pending();  // an update on the way: no part of the set yet
    if (!folder::is_level(*relative.begin()) && it->is_directory(none) &&
        fs::exists(it->path().string() + folder::kLedger, none))
      it.disable_recursion_pending();  // another set, with tiles of its own
    if (it->path().extension() != folder::kTileSuffix) {
      if (it.depth() > 0 ? it->is_directory(none) || !folder::is_level(*relative.begin())
                         : folder::is_own_name(relative.string(), blocks))
        continue;
      const auto old_blocks = moving_ && it.depth() == 0 ? folder::is_blocks(it->path()) : false;
      if (!old_blocks) return std::unexpected(old_blocks.error());
      if (*old_blocks) continue;
      listing.others.push_back(relative.string() + (it->is_directory(none) ? "/" : ""));
      continue;
    }
    if (const auto id = folder::tile_of_path(relative)) {
      if (listing.levels.size() <= std::size_t(id->level)) listing.levels.resize(id->level + 1u);
      listing.levels[std::size_t(id->level)].push_back(*id);
    } else {
      listing.strays.push_back(relative.string());
    }
  }
  if (error) return folder::cannot_look(last, error);  // at its end, too: what was seen is not all
  for (auto& level : listing.levels) std::ranges::sort(level);
  std::ranges::sort(listing.strays);
  std::ranges::sort(listing.others);
  return listing;
}

/// The hashes of blocks are those that the record names: without them there is no update.
std::vector<StoreFault> FolderStore::faults() const {
  std::vector<StoreFault> faults;
  const auto own_name = [](const std::string& path) { return path.substr(1); };  // without the '/'
  if (damaged_)
    faults.push_back({StoreFault::In::ledger, own_name(folder::kLedger),
                      damaged_->code == Errc::io ? "cannot be read" : "damaged",
                      damaged_->code == Errc::io});
  const auto known = ledger();
  if (const auto text = read_stored_file(base_ + folder::kRecord);
      known && !moving_ && !(text && known->belongs_to(text_of(*text))))
    faults.push_back({StoreFault::In::ledger, own_name(folder::kRecord),
                      text ? "is not the record that the ledger belongs to" : "cannot be read",
                      !text && text.error().code == Errc::io});
  const auto made = record();
  if (!made || !*made || (*made)->heights.empty()) return faults;
  const std::string& heights = (*made)->heights;
  const std::string blocks = folder::kBlocks + heights;
  const auto bytes = read_beside(blocks);
  if (!bytes)
    faults.push_back({StoreFault::In::blocks, own_name(blocks), "cannot be read",
                      bytes.error().code == Errc::io});
  else if (!SourceBlocks::whole(text_of(*bytes), heights))
    faults.push_back({StoreFault::In::blocks, own_name(blocks), "damaged"});
  return faults;
}

}  // namespace

std::unique_ptr<TileStore> folder_store(const std::string& directory) {
  return std::make_unique<FolderStore>(directory);
}

Result<std::string> kept_blocks(const std::string& directory, const BuildRecord& record) {
  return read_regular_file(without_layer(directory) + folder::kBlocks + record.heights);
}

Result<Bytes> read_stored_file(const std::string& path) {
  std::error_code error;
  const auto size = fs::file_size(path, error);
  if (error) {
    const bool missing = error == std::errc::no_such_file_or_directory;
    const bool other = error == std::errc::is_a_directory || error == std::errc::not_supported;
    return fail(missing ? Errc::not_found
                : other ? Errc::bad_data
                        : Errc::io,
                path + ": " + (other ? "not a regular file" : error.message()));
  }
  if (size > kLargestStored) return fail(Errc::bad_data, path + " is too large for a tile");
  Bytes bytes(size);
  std::ifstream in(path, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(size)))
    return fail(Errc::io, "cannot read " + path);
  return bytes;
}

}  // namespace tind
