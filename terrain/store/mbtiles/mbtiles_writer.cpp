// One transaction without a journal: what a crash leaves has no name yet. Indices come after the
// rows, so that every page is written once, in order.

#include "terrain/store/mbtiles/mbtiles_writer.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <utility>

#include "terrain/base/file_there.h"
#include "terrain/base/hash.h"
#include "terrain/base/sqlite.h"
#include "terrain/store/ledger_entry.h"
#include "terrain/store/mbtiles/mbtiles_seal.h"
#include "terrain/store/part_file.h"

namespace tind {

namespace {

using namespace mbtiles;

constexpr const char* kMake =
    "PRAGMA page_size = 4096; PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF;"
    "PRAGMA application_id = 0x4d504258;"  // "MPBX", as the format wants
    "BEGIN;"
    "CREATE TABLE metadata (name TEXT, value TEXT);"
    "CREATE TABLE tiles (zoom_level INTEGER, tile_column INTEGER, tile_row INTEGER,"
    " tile_data BLOB);"
    "CREATE TABLE tind_entries (zoom_level INTEGER, tile_column INTEGER, tile_row INTEGER,"
    " entry BLOB, PRIMARY KEY (zoom_level, tile_column, tile_row)) WITHOUT ROWID;"
    "CREATE TABLE tind_blocks (hashes BLOB);";
constexpr const char* kIndices =
    "CREATE UNIQUE INDEX name ON metadata (name);"
    "CREATE UNIQUE INDEX tile_index ON tiles (zoom_level, tile_column, tile_row);"
    "COMMIT;";

std::string degrees(const std::array<double, 4>& bounds) {
  std::array<char, 120> text;
  std::snprintf(text.data(), text.size(), "%.9g,%.9g,%.9g,%.9g", bounds[0], bounds[1], bounds[2],
                bounds[3]);
  return text.data();
}

/// What an earlier database of this name left behind: SQLite would play it into the new one.
Result<void> nothing_to_replay(const std::string& file) {
  for (const char* const ending : {"-wal", "-journal"}) {
    const auto there = is_there(file + ending);
    if (!there) return std::unexpected(there.error());
    if (*there)
      return fail(Errc::invalid_argument,
                  file + ending +
                      " is there, of a database that is in use or was never closed, and "
                      "would become a part of the new one: move it away, or name "
                      "another file");
  }
  return {};
}

class Writer : public ArchiveWriter {
 public:
  Writer(std::string file, PartFile part, Sqlite db, ArchiveHead head)
      : file_(std::move(file)), part_(std::move(part)), db_(std::move(db)), head_(std::move(head)) {
    seal_.head = head_.seed();
    tile_.emplace(db_, "INSERT INTO tiles VALUES (?,?,?,?)");
    entry_.emplace(db_, "INSERT INTO tind_entries VALUES (?,?,?,?)");
  }

  void put_in_order(std::vector<TileId>& ids) const override { std::ranges::sort(ids); }

  Result<void> add(TileId id, const std::vector<std::uint8_t>& packed, TileFacts facts) override {
    LedgerEntry entry{.id = id, .facts = facts};
    entry.take({reinterpret_cast<const char*>(packed.data()), packed.size()});
    const std::string place = encode_place(entry, seal_.head);
    seal_.entries = hash64(place, seal_.entries);
    ++seal_.tiles;
    if (auto done = put(*tile_, id, packed); !done) return done;
    return put(*entry_, id, place);
  }

  Result<void> finish() override {
    if (!head_.blocks.empty()) {
      seal_.blocks = hash64(head_.blocks);
      SqliteQuery query(db_, "INSERT INTO tind_blocks VALUES (?)");
      if (auto done = query.bind_bytes(head_.blocks).run(); !done) return done;
    }
    if (auto done = put_metadata(); !done) return done;
    tile_.reset(), entry_.reset();
    if (auto done = db_.run(kIndices); !done) return done;
    { const Sqlite closed = std::move(db_); }
    if (auto alone = nothing_to_replay(file_); !alone) return alone;
    return part_.finish();
  }

 private:
  const std::string file_;
  PartFile part_;
  Sqlite db_;
  const ArchiveHead head_;
  Seal seal_;
  std::optional<SqliteQuery> tile_, entry_;

  static Result<void> put(SqliteQuery& query, TileId id, ByteView bytes) {
    query.again();
    query.bind(std::int64_t(id.level)).bind(std::int64_t(id.x)).bind(std::int64_t(id.y));
    return query.bind_bytes(bytes).run();
  }
  Result<void> put_metadata();
};

Result<void> Writer::put_metadata() {
  const proto::LayerJson& layer = head_.layer;
  std::vector<std::pair<std::string, std::string>> rows = {
      {"name", layer.name},
      {"format", "terrain"},
      {"type", "baselayer"},
      {"version", layer.version},
      {"description", layer.description},
      {"attribution", layer.attribution},
      {"bounds", degrees(layer.bounds)},
      {"minzoom", std::to_string(layer.minzoom)},
      {"maxzoom", std::to_string(layer.maxzoom)},
      {"scheme", "tms"},
      {"projection", layer.projection},
      {kLayer, head_.layer_text}};
  if (!head_.record_text.empty()) rows.emplace_back(kRecord, head_.record_text);
  rows.emplace_back(kSeal, encode(seal_));
  SqliteQuery query(db_, "INSERT INTO metadata VALUES (?,?)");
  for (const auto& [name, value] : rows) {
    query.again();
    if (auto done = query.bind(name).bind(value).run(); !done) return done;
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<ArchiveWriter>> write_mbtiles(const std::string& file, ArchiveHead head) {
  if (auto alone = nothing_to_replay(file); !alone) return std::unexpected(alone.error());
  auto part = PartFile::begin(file, "SQLite format 3");
  if (!part) return std::unexpected(part.error());
  auto db = Sqlite::open(part->path(), Sqlite::Open::alone);
  if (!db) return std::unexpected(db.error());
  if (auto made = db->run(kMake); !made) return std::unexpected(made.error());
  return std::make_unique<Writer>(file, std::move(*part), std::move(*db), std::move(head));
}

}  // namespace tind
