// One connection, which takes one question at a time: a lookup takes some microseconds.

#include "terrain/store/mbtiles/mbtiles_store.h"

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <utility>

#include "terrain/base/file_there.h"
#include "terrain/base/hash.h"
#include "terrain/base/sqlite.h"
#include "terrain/store/ledger_entry.h"
#include "terrain/store/mbtiles/mbtiles_seal.h"

namespace tind {

namespace {

namespace fs = std::filesystem;
using namespace mbtiles;
using Bytes = std::vector<std::uint8_t>;

// Million steps. A lookup in an indexed table takes none; a check looks at tables alone, of which
// there is no more than the file has bytes.
constexpr int kLookup = 50, kSorting = 5000, kWholeFile = 1'000'000;

std::string_view text_of(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class MbtilesStore : public TileStore {
 public:
  explicit MbtilesStore(const std::string& path) : path_(path) { opened_ = open(); }

  std::string name() const override { return path_; }
  std::string layer_name() const override { return path_; }
  std::string tile_name(TileId id) const override { return path_ + " " + id.text(); }
  bool remote() const override { return false; }

  Result<Bytes> layer_json() const override {
    if (!opened_) return std::unexpected(opened_.error());
    return Bytes(layer_.begin(), layer_.end());
  }
  Result<std::optional<BuildRecord>> record() const override {
    if (!opened_) return without_record(opened_.error());
    if (record_.empty()) return std::nullopt;
    return decode_build_record(record_);
  }
  Result<std::string> kept_blocks() const override;

  Result<Bytes> read(TileId) const override;
  Result<StoredTile> look_at(TileId) const override;
  Result<std::optional<std::uint64_t>> size(TileId) const override;
  Result<std::optional<StoreListing>> list() const override;

  std::optional<std::uint64_t> generation() const override {
    if (!opened_ || !seal_) return {};
    return hash64(encode(*seal_));
  }
  Result<void> vouched_for() const override { return opened_; }
  std::vector<StoreFault> faults() const override;

 private:
  const std::string path_;
  std::uint64_t bytes_ = 0;  // of the file
  Result<void> opened_;
  std::string layer_, record_;
  std::optional<Seal> seal_;
  mutable std::mutex mutex_;  // of what follows
  mutable std::optional<Sqlite> db_;
  mutable std::optional<SqliteQuery> tile_, entry_, size_;
  mutable std::optional<Error> gave_up_;  // why no tile is looked for any more

  std::unexpected<Error> damaged(const std::string& what) const {
    return fail(Errc::bad_data, path_ + ": " + what);
  }
  Result<void> open();
  Result<void> open_sealed(const std::string& seal);
  Result<std::optional<std::string>> metadata(const char* name);
  /// Of a view that takes a second for a tile all tiles would, and nobody else gets to ask.
  Result<bool> ask(SqliteQuery& query, TileId id) const {
    if (gave_up_) return std::unexpected(*gave_up_);
    query.again();
    query.bind(std::int64_t(id.level)).bind(std::int64_t(id.x)).bind(std::int64_t(id.y));
    auto row = query.within(kLookup).next();
    if (!row && db_->took_too_long()) gave_up_ = row.error();
    return row;
  }
  void look_through_entries(std::vector<StoreFault>&) const;
};

Result<std::optional<std::string>> MbtilesStore::metadata(const char* name) {
  SqliteQuery query(*db_, "SELECT value FROM metadata WHERE name = ?");
  query.bind(std::string_view(name));
  const auto row = query.next();
  if (!row) return std::unexpected(row.error());
  return *row ? std::optional(query.text(0)) : std::nullopt;
}

Result<void> MbtilesStore::open() {
  const auto type = file_type_of(path_);
  if (!type) return std::unexpected(type.error());
  if (*type != fs::file_type::regular)
    return fail(*type == fs::file_type::not_found ? Errc::not_found : Errc::bad_data,
                path_ + " is not a file");
  std::error_code error;
  bytes_ = fs::file_size(path_, error);
  if (error) return fail(Errc::io, "cannot look into " + path_ + ": " + error.message());
  auto db = Sqlite::open(path_, Sqlite::Open::read);
  if (!db) return std::unexpected(db.error());
  db_.emplace(std::move(*db));
  // To SQLite a table that is not there is an error as one of reading is.
  const auto tables =
      db_->number("SELECT count(*) FROM sqlite_master WHERE name = 'metadata' COLLATE NOCASE");
  if (!tables) return std::unexpected(tables.error());
  if (*tables == 0) return fail(Errc::unsupported, path_ + " is no MBTiles: it has no metadata");
  const auto layer = metadata(kLayer), record = metadata(kRecord), seal = metadata(kSeal);
  for (const auto* one : {&layer, &record, &seal})
    if (!*one) return std::unexpected(one->error());
  if (!*layer)
    return fail(
        Errc::unsupported,
        path_ + " holds no quantized-mesh tiles that tind packed: its metadata have no " + kLayer);
  layer_ = **layer, record_ = record->value_or("");
  constexpr const char* kPlace = " WHERE zoom_level = ? AND tile_column = ? AND tile_row = ?";
  tile_.emplace(*db_, std::string("SELECT tile_data FROM tiles") + kPlace);
  size_.emplace(*db_, std::string("SELECT length(tile_data) FROM tiles") + kPlace);
  if (!*seal) return {};
  entry_.emplace(*db_, std::string("SELECT entry FROM tind_entries") + kPlace);
  return open_sealed(**seal);
}

Result<void> MbtilesStore::open_sealed(const std::string& text) {
  seal_ = decode_seal(text);
  if (!seal_ || seal_->head != hash64(record_, hash64(layer_)))
    return damaged("its metadata are not as they were written");
  const auto pages = db_->number("PRAGMA page_count"), page = db_->number("PRAGMA page_size");
  if (!pages || !page) return std::unexpected(db_->error());
  if (std::uint64_t(*pages) * std::uint64_t(*page) != bytes_)
    return damaged("is cut off, or longer than it was");
  return {};
}

Result<std::string> MbtilesStore::kept_blocks() const {
  if (!opened_) return std::unexpected(opened_.error());
  if (!seal_ || seal_->blocks == 0) return TileStore::kept_blocks();
  const std::lock_guard lock(mutex_);
  SqliteQuery query(*db_, "SELECT hashes FROM tind_blocks");
  const auto row = query.next();
  if (!row) return std::unexpected(row.error());
  if (!*row || hash64(query.bytes(0)) != seal_->blocks)
    return damaged("its hashes of blocks are damaged");
  return query.text(0);
}

Result<StoredTile> MbtilesStore::look_at(TileId id) const {
  if (!opened_) return std::unexpected(opened_.error());
  const std::lock_guard lock(mutex_);
  const auto row = ask(*tile_, id);
  if (!row) return std::unexpected(row.error());
  if (!*row) return fail(Errc::not_found, path_ + " has no tile " + id.text());
  const std::string_view bytes = tile_->bytes(0);
  if (bytes.size() > kLargestStored) return damaged("tile " + id.text() + " is too large");
  StoredTile tile{{bytes.begin(), bytes.end()}, Vouched::by_nobody};
  tile_->again();
  if (!seal_) return tile;
  tile.vouched = Vouched::not_listed;
  const auto listed = ask(*entry_, id);
  if (!listed) return std::unexpected(listed.error());
  const auto entry =
      *listed ? decode_place(entry_->bytes(0), id, seal_->head) : std::optional<LedgerEntry>();
  entry_->again();
  if (!entry) return tile;
  tile.vouched = entry->vouches_for(text_of(tile.bytes)) ? Vouched::yes : Vouched::other_bytes;
  if (tile.vouched == Vouched::yes) tile.facts = entry->facts;
  return tile;
}

Result<Bytes> MbtilesStore::read(TileId id) const {
  auto tile = look_at(id);
  if (!tile) return std::unexpected(tile.error());
  if (tile->vouched == Vouched::by_nobody || tile->vouched == Vouched::yes)
    return std::move(tile->bytes);
  return fail(Errc::io, tile_name(id) +
                            " is not as it was written: the file is damaged, or another program "
                            "changed it; tind verify says more, and mends it");
}

Result<std::optional<std::uint64_t>> MbtilesStore::size(TileId id) const {
  if (!opened_) return std::unexpected(opened_.error());
  const std::lock_guard lock(mutex_);
  const auto row = ask(*size_, id);
  if (!row) return std::unexpected(row.error());
  const auto size = *row ? std::optional(std::uint64_t(size_->integer(0))) : std::nullopt;
  size_->again();
  return size;
}

Result<std::optional<StoreListing>> MbtilesStore::list() const {
  if (!opened_) return std::unexpected(opened_.error());
  const std::lock_guard lock(mutex_);
  StoreListing listing;
  SqliteQuery query(*db_, "SELECT zoom_level, tile_column, tile_row FROM tiles");
  for (std::uint64_t left = bytes_;; --left) {  // a view may have rows without end
    const auto row = query.next();
    if (!row) return std::unexpected(row.error());
    if (!*row) break;
    if (left == 0) return damaged("it names more tiles than it has bytes");
    const auto id = tiling::tile(query.integer(0), query.integer(1), query.integer(2));
    if (!id) {
      listing.strays.push_back(query.text(0) + "/" + query.text(1) + "/" + query.text(2));
      continue;
    }
    if (listing.levels.size() <= std::size_t(id->level)) listing.levels.resize(id->level + 1u);
    listing.levels[std::size_t(id->level)].push_back(*id);
  }
  for (auto& level : listing.levels) {
    std::ranges::sort(level);
    const auto twice = std::ranges::unique(level);
    level.erase(twice.begin(), twice.end());
  }
  std::ranges::sort(listing.strays);
  return listing;
}

void MbtilesStore::look_through_entries(std::vector<StoreFault>& faults) const {
  SqliteQuery query(*db_,
                    "SELECT entry FROM tind_entries ORDER BY zoom_level, tile_column, tile_row");
  query.within(kSorting);
  std::uint64_t hash = 0, count = 0;
  for (;;) {
    const auto row = query.next();
    if (!row)
      return faults.push_back(
          {StoreFault::In::ledger, path_, row.error().what, row.error().code == Errc::io});
    if (!*row) break;
    hash = hash64(query.bytes(0), hash), ++count;
  }
  if (hash != seal_->entries || count != seal_->tiles)
    faults.push_back({StoreFault::In::ledger, path_, "its entries of tiles are damaged"});
}

std::vector<StoreFault> MbtilesStore::faults() const {
  std::vector<StoreFault> faults;
  const auto found = [&](const std::string& what, bool unread = false) {
    faults.push_back({StoreFault::In::ledger, path_, what, unread});
  };
  const auto cannot = [&](const Error& error) { found(error.what, error.code == Errc::io); };
  if (!opened_) return cannot(opened_.error()), faults;
  {
    const std::lock_guard lock(mutex_);
    SqliteQuery query(*db_, "PRAGMA integrity_check(1)");
    query.within(kWholeFile);
    const auto row = query.next();
    if (!row)
      cannot(row.error());
    else if (!*row || query.text(0) != "ok")
      found("the database is damaged: " + query.text(0));
    if (seal_) look_through_entries(faults);
  }
  if (const auto blocks = kept_blocks(); !blocks && seal_ && seal_->blocks != 0)
    faults.push_back({StoreFault::In::blocks, path_, "its hashes of blocks are damaged"});
  return faults;
}

}  // namespace

std::unique_ptr<TileStore> mbtiles_store(const std::string& file) {
  return std::make_unique<MbtilesStore>(file);
}

}  // namespace tind
