// Archives, written and read by way of the contracts alone: what goes in comes out, whatever breaks
// is refused or found, and nothing half made ever has the name.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "proto/tile/pmtiles.h"
#include "terrain/base/deflate.h"
#include "terrain/base/file_io.h"
#include "terrain/base/sqlite.h"
#include "terrain/check/verify_store.h"
#include "terrain/raster/source_blocks.h"
#include "terrain/store/copy/copy_store.h"
#include "terrain/store/open/open_store.h"
#include "tests/support/as_somebody_else.h"
#include "tests/support/made_up_tiles.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kLayer =
    R"({"format": "quantized-mesh-1.0", "scheme": "tms", "tiles": ["{z}/{x}/{y}.terrain"],
 "projection": "EPSG:4326", "version": "1.0.0", "name": "a hill",
 "available": [[{"startX": 0, "startY": 0, "endX": 1, "endY": 0}],
  [{"startX": 2, "startY": 0, "endX": 3, "endY": 1}]]})";

std::string text_of(const Result<std::vector<std::uint8_t>>& bytes) {
  return bytes ? std::string(bytes->begin(), bytes->end()) : "error: " + bytes.error().what;
}

/// The same tiles in memory, as another program's store.
class InMemory : public TileStore {
 public:
  std::string name() const override { return "memory"; }
  std::string layer_name() const override { return "layer"; }
  std::string tile_name(TileId id) const override { return id.text(); }
  bool remote() const override { return false; }
  Result<std::vector<std::uint8_t>> layer_json() const override {
    return std::vector<std::uint8_t>(layer.begin(), layer.end());
  }
  Result<std::optional<BuildRecord>> record() const override { return made; }
  Result<std::string> kept_blocks() const override {
    if (!made) return TileStore::kept_blocks();
    return blocks;
  }
  Result<std::vector<std::uint8_t>> read(TileId id) const override {
    if (id.text() == missing) return fail(Errc::not_found, "not there");
    if (real)
      return test::MadeUpTiles().tile(id.text() == mixed_up ? TileId{1, 0, 0} : id, {})->bytes;
    const std::string text = id.text() + mark;
    return packed ? deflate(text, Wrapping::gzip, 1)
                  : std::vector<std::uint8_t>(text.begin(), text.end());
  }
  Result<StoredTile> look_at(TileId id) const override {
    auto bytes = read(id);
    if (!bytes) return std::unexpected(bytes.error());
    return StoredTile{std::move(*bytes), vouched, facts};
  }

  std::string layer = kLayer, mark = " a", blocks = "TNSB blocks", missing;
  std::optional<BuildRecord> made = BuildRecord{};
  std::optional<TileFacts> facts = TileFacts{0, 2.5, 0.5, true};
  Vouched vouched = Vouched::yes;
  bool packed = false, real = false;
  std::string mixed_up;  // of real ones: this is another's
};

constexpr TileId kTiles[] = {{0, 0, 0}, {0, 1, 0}, {1, 2, 0}, {1, 2, 1}, {1, 3, 0}, {1, 3, 1}};

class ArchiveStore : public testing::TestWithParam<const char*> {
 protected:
  std::string path(const std::string& name = "a") const { return folder_.file(name + GetParam()); }
  /// Every tile is as it was, or is not given.
  static bool serves_no_other(const TileStore& store, const std::string& mark = " a") {
    return std::ranges::all_of(kTiles, [&](TileId id) {
      auto bytes = store.read(id);
      return !bytes || (gunzip(*bytes) && text_of(bytes) == id.text() + mark);
    });
  }
  Result<CopyReport> copy(const InMemory& from, const std::string& to, CopyOptions o = {}) const {
    return copy_store(from, to, o);
  }
  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& entry : fs::directory_iterator(folder_.path()))
      all.push_back(entry.path().filename().string());
    std::ranges::sort(all);
    return all;
  }

  test::TempDir folder_;
  InMemory from_;
};

INSTANTIATE_TEST_SUITE_P(Kinds, ArchiveStore, testing::Values(".pmtiles", ".mbtiles"),
                         [](const auto& kind) { return std::string(kind.param + 1); });

TEST_P(ArchiveStore, WhatGoesInComesOut) {
  const auto report = copy(from_, path());
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->tiles, 6u);
  const auto store = open_store(path());
  EXPECT_EQ(text_of(store->layer_json()), kLayer);
  const auto record = store->record();
  ASSERT_TRUE(record && *record);
  EXPECT_EQ(encode(**record), encode(*from_.made));
  EXPECT_EQ(store->kept_blocks().value_or("none"), "TNSB blocks");
  for (const TileId id : kTiles) {
    auto tile = store->look_at(id);
    ASSERT_TRUE(tile) << tile.error().what;
    EXPECT_EQ(tile->vouched, Vouched::yes);
    EXPECT_EQ(store->size(id), tile->bytes.size());
    ASSERT_TRUE(tile->facts);
    EXPECT_EQ(tile->facts->max_error_m, 2.5);
    EXPECT_EQ(tile->facts->edge_error_m, 0.5);
    EXPECT_TRUE(tile->facts->not_one_sided);
    ASSERT_TRUE(gunzip(tile->bytes));
    EXPECT_EQ(text_of(tile->bytes), id.text() + " a");
  }
  EXPECT_EQ(store->read({1, 0, 0}).error().code, Errc::not_found);
  EXPECT_EQ(store->read({5, 0, 0}).error().code, Errc::not_found);
  EXPECT_FALSE(store->size({1, 0, 0}).value());
  const auto listed = store->list();
  ASSERT_TRUE(listed && *listed);
  ASSERT_EQ((*listed)->levels.size(), 2u);
  EXPECT_EQ((*listed)->levels[0], (std::vector<TileId>{kTiles[0], kTiles[1]}));
  EXPECT_EQ((*listed)->levels[1], (std::vector<TileId>(kTiles + 2, kTiles + 6)));
  EXPECT_THAT((*listed)->strays, IsEmpty());
  EXPECT_THAT(store->faults(), IsEmpty());
  EXPECT_TRUE(verify_store(*store)->ok());
  EXPECT_EQ(names(), std::vector{"a" + std::string(GetParam())});
}

TEST_P(ArchiveStore, TheSameTilesAreTheSameBytesWhateverHoldsThem) {
  ASSERT_TRUE(copy(from_, path("a")));
  from_.packed = true;
  ASSERT_TRUE(copy(from_, path("b"), {.threads = 1}));
  const auto first = read_whole_file(path("a"));
  EXPECT_TRUE(*first == *read_whole_file(path("b")));
  ASSERT_TRUE(copy_store(*open_store(path("a")), path("c"), {}));
  EXPECT_TRUE(*first == *read_whole_file(path("c")));
  const auto before = open_store(path("a"))->generation();
  ASSERT_TRUE(before);
  EXPECT_EQ(before, open_store(path("b"))->generation());
  from_.mark = " b";
  ASSERT_TRUE(copy(from_, path("a")));
  EXPECT_NE(before, open_store(path("a"))->generation());
}

TEST_P(ArchiveStore, WhatSqliteWouldReplayIntoItIsNotLeftBesideIt) {
  if (std::string(GetParam()) != ".mbtiles") return;
  for (const char* const ending : {"-wal", "-journal"}) {
    ASSERT_TRUE(write_whole_file(path() + ending, "of another database"));
    const auto copied = copy(from_, path());
    ASSERT_FALSE(copied);
    EXPECT_THAT(copied.error().what, HasSubstr(ending));
    EXPECT_FALSE(fs::exists(path()));
    fs::remove(path() + ending);
    fs::create_symlink(path() + ending, path() + ending);  // what is there cannot be told
    EXPECT_EQ(copy(from_, path()).error().code, Errc::io);
    EXPECT_FALSE(fs::exists(path()));
    fs::remove(path() + ending);
  }
  EXPECT_TRUE(copy(from_, path()));
}

TEST_P(ArchiveStore, OpenedBeforeItIsReplacedItGivesTheOldTiles) {
  ASSERT_TRUE(copy(from_, path()));
  const auto before = open_store(path());
  from_.mark = " b";
  ASSERT_TRUE(copy(from_, path()));
  EXPECT_TRUE(serves_no_other(*before, " a"));
  EXPECT_TRUE(serves_no_other(*open_store(path()), " b"));
}

/// Each byte in turn is another; in a database every third one, whose pages have much empty space.
TEST_P(ArchiveStore, AFlippedByteIsNeverServed) {
  ASSERT_TRUE(copy(from_, path()));
  const std::string good = *read_whole_file(path());
  const bool sealed = std::string(GetParam()) == ".pmtiles";
  std::size_t refused = 0, found = 0, harmless = 0;
  for (std::size_t at = 0; at < good.size(); at += sealed ? 1 : 3) {
    std::string bad = good;
    bad[at] = char(bad[at] ^ (1 << at % 8));
    std::ofstream(path("bad"), std::ios::binary) << bad;
    const auto store = open_store(path("bad"));
    ASSERT_TRUE(serves_no_other(*store)) << "byte " << at;
    const auto layer = store->layer_json();
    if (!layer) {
      ++refused;
      continue;
    }
    ASSERT_EQ(text_of(layer), kLayer) << "byte " << at;
    const auto report = verify_store(*store, 1);
    ++(report && report->ok() ? harmless : found);
    if (sealed) {
      ASSERT_TRUE(report && !report->ok()) << "byte " << at;
    }
  }
  EXPECT_GT(refused, 100u);
  EXPECT_GT(found, 100u);
  EXPECT_EQ(harmless == 0, sealed);
}

TEST_P(ArchiveStore, OneThatIsCutOffOrLongerIsRefused) {
  ASSERT_TRUE(copy(from_, path()));
  const std::string good = *read_whole_file(path());
  for (std::size_t size = 0; size < good.size(); size += 1 + good.size() / 997) {
    std::ofstream(path("bad"), std::ios::binary) << good.substr(0, size);
    const auto store = open_store(path("bad"));
    ASSERT_FALSE(store->layer_json()) << size;
    ASSERT_FALSE(store->read(kTiles[0]));
    ASSERT_FALSE(store->vouched_for());
    ASSERT_FALSE(store->generation());
  }
  std::ofstream(path("bad"), std::ios::binary) << good << "x";
  EXPECT_EQ(open_store(path("bad"))->layer_json().error().code, Errc::bad_data);
  EXPECT_EQ(open_store(path("none"))->layer_json().error().code, Errc::not_found);
}

TEST_P(ArchiveStore, OneThatIsCutOffWhileItIsOpenGivesErrors) {
  ASSERT_TRUE(copy(from_, path()));
  const auto store = open_store(path());
  fs::resize_file(path(), 100);
  EXPECT_TRUE(serves_no_other(*store));
  EXPECT_FALSE(store->read(kTiles[5]));
}

TEST_P(ArchiveStore, WhatIsAnothersIsNotReplaced) {
  std::ofstream(path()) << "somebody's";
  const auto refused = copy(from_, path(), {.force = true});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::invalid_argument);
  EXPECT_EQ(*read_whole_file(path()), "somebody's");
  // Tiles of tind's own of another source: only with force.
  fs::remove(path());
  ASSERT_TRUE(copy(from_, path()));
  from_.made->grid = "another";
  EXPECT_EQ(copy(from_, path()).error().code, Errc::invalid_argument);
  EXPECT_TRUE(copy(from_, path(), {.force = true}));
  // Onto itself.
  EXPECT_EQ(copy_store(*open_store(path()), path(), {.force = true}).error().code,
            Errc::invalid_argument);
}

/// A name of which cannot be told what it stands for is not a free one.
TEST_P(ArchiveStore, WhatCannotBeLookedAtIsNotReplaced) {
  fs::create_symlink(path(), path());  // round in a circle: also root cannot follow it
  for (const bool force : {false, true}) {
    const auto copied = copy(from_, path(), {.force = force});
    ASSERT_FALSE(copied);
    EXPECT_EQ(copied.error().code, Errc::io) << copied.error().what;
    EXPECT_TRUE(fs::is_symlink(path()));
  }
  const std::string inside = folder_.file("somewhere");
  fs::create_symlink(inside, inside);
  EXPECT_EQ(copy(from_, inside).error().code, Errc::io);
  fs::remove(inside);
  EXPECT_EQ(names().size(), 1u);
}

TEST_P(ArchiveStore, WhatCannotBeReadIsNotTakenForForeign) {
  ASSERT_TRUE(copy(from_, path()));
  const std::string before = *read_whole_file(path());
  test::give_to_somebody(folder_.path());
  {
    const test::Closed closed(path());
    const test::AsSomebodyElse nobody;
    const auto copied = copy(from_, path(), {.force = true});
    ASSERT_FALSE(copied);
    EXPECT_EQ(copied.error().code, Errc::io) << copied.error().what;
  }
  EXPECT_TRUE(*read_whole_file(path()) == before);
}

TEST(CopyStore, ADatabaseOfSomebodyElseIsNotReplaced) {
  test::TempDir folder;
  const std::string path = folder.file("a.mbtiles");
  {
    auto db = Sqlite::open(path, Sqlite::Open::write);
    ASSERT_TRUE(db);
    ASSERT_TRUE(db->run("CREATE TABLE thesis (words TEXT)"));
  }
  const std::string before = *read_whole_file(path);
  EXPECT_EQ(copy_store(InMemory(), path, {.force = true}).error().code, Errc::invalid_argument);
  EXPECT_TRUE(*read_whole_file(path) == before);
}

TEST_P(ArchiveStore, WhatAKilledCopyLeftIsWrittenOver) {
  const std::string part = path() + ".tind-part";
  std::ofstream(part) << (std::string(GetParam()) == ".pmtiles" ? "PMTiles"
                                                                : "SQLite format 3 and more");
  ASSERT_TRUE(copy(from_, path()));
  EXPECT_EQ(names().size(), 1u);
  std::ofstream(part) << "somebody's";
  EXPECT_THAT(copy(from_, path()).error().what, HasSubstr("move it away"));
  EXPECT_EQ(*read_whole_file(part), "somebody's");
  fs::remove(part);
  const int file = ::open(part.c_str(), O_RDWR | O_CREAT, 0666);
  ASSERT_EQ(::flock(file, LOCK_EX), 0);
  EXPECT_EQ(copy(from_, path()).error().code, Errc::busy);
  ::close(file);
}

TEST_P(ArchiveStore, ACopyThatFailsLeavesNothing) {
  from_.missing = "1/3/0";
  EXPECT_EQ(copy(from_, path()).error().code, Errc::not_found);
  from_.missing.clear();
  from_.vouched = Vouched::other_bytes;
  EXPECT_EQ(copy(from_, path()).error().code, Errc::bad_data);
  from_.vouched = Vouched::yes;
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(copy_store(from_, path(), {}, {{}, stop.get_token()}).error().code, Errc::cancelled);
  EXPECT_THAT(names(), IsEmpty());
}

TEST_P(ArchiveStore, TilesWithoutARecordAreCopiedAndVouchedForFromThenOn) {
  from_.made.reset();
  from_.blocks.clear();
  from_.facts.reset();
  from_.vouched = Vouched::by_nobody;
  from_.real = true;
  const auto report = copy(from_, path());
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->unvouched, 6u);
  const auto store = open_store(path());
  EXPECT_FALSE(*store->record());
  EXPECT_EQ(store->kept_blocks().error().code, Errc::not_found);
  EXPECT_TRUE(verify_store(*store)->ok());
}

/// A server may answer with a page that asks for a password, or with another place's tile.
TEST_P(ArchiveStore, WhatIsNotTheTileIsNotCopied) {
  from_.made.reset();
  from_.blocks.clear();
  from_.facts.reset();
  from_.vouched = Vouched::by_nobody;
  const auto page = copy(from_, path());
  ASSERT_FALSE(page);
  EXPECT_EQ(page.error().code, Errc::bad_data);
  from_.real = true, from_.mixed_up = "1/3/1";
  const auto other = copy(from_, path());
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().what, HasSubstr("1/3/1 is the tile of another place"));
  EXPECT_THAT(names(), IsEmpty());
}

TEST_P(ArchiveStore, ThroughADirectoryAndBackItIsTheSame) {
  DemInfo info;
  info.cols = info.rows = 20;
  SourceBlocks blocks(info);
  blocks.add(0, 0, HeightGrid(20, 20));
  from_.made->heights = blocks.digest(), from_.blocks = blocks.encode();
  ASSERT_TRUE(copy(from_, path()));
  const std::string tiles = folder_.file("tiles");
  ASSERT_TRUE(copy_store(*open_store(path()), tiles, {}));
  EXPECT_EQ(*read_whole_file(tiles + "/1/2/1.terrain"), "1/2/1 a");
  EXPECT_TRUE(verify_store(*open_store(tiles))->ok());
  EXPECT_EQ(copy_store(*open_store(path()), tiles, {})->kept, 6u);
  ASSERT_TRUE(copy_store(*open_store(tiles), path("back"), {}));
  EXPECT_TRUE(*read_whole_file(path()) == *read_whole_file(path("back")));
}

TEST(CopyStore, WithoutARecordADirectoryGetsWhatIsNew) {
  test::TempDir folder;
  InMemory from;
  from.made.reset();
  from.blocks.clear();
  from.vouched = Vouched::by_nobody;
  const std::string tiles = folder.file("tiles");
  ASSERT_TRUE(copy_store(from, tiles, {}));
  EXPECT_EQ(copy_store(from, tiles, {})->kept, 6u);
  from.mark = " b";
  EXPECT_EQ(copy_store(from, tiles, {})->kept, 0u);
  const auto store = open_store(tiles);
  EXPECT_EQ(text_of(store->read({1, 2, 1})), "1/2/1 b");
  EXPECT_TRUE(verify_store(*store)->ok());
}

TEST(CopyStore, ADirectoryOfTilesThatTindDidNotMakeIsRefused) {
  test::TempDir folder;
  InMemory from;
  const std::string tiles = folder.file("tiles");
  fs::create_directories(tiles);
  std::ofstream(tiles + "/layer.json") << "{}";
  EXPECT_EQ(copy_store(from, tiles, {.force = true}).error().code, Errc::invalid_argument);
  std::ofstream(folder.file("a.txt")) << "text";
  EXPECT_EQ(copy_store(from, folder.file("a.txt"), {}).error().code, Errc::invalid_argument);
}

TEST(CopyStore, NothingIsCopiedIntoItself) {
  test::TempDir folder;
  InMemory from;
  DemInfo info;
  info.cols = info.rows = 20;
  SourceBlocks blocks(info);
  blocks.add(0, 0, HeightGrid(20, 20));
  from.made->heights = blocks.digest(), from.blocks = blocks.encode();
  const std::string tiles = folder.file("tiles");
  ASSERT_TRUE(copy_store(from, tiles, {}));
  for (const char* inside : {"/1", "/new/one", "/x.pmtiles", ""})
    EXPECT_EQ(copy_store(*open_store(tiles), tiles + inside, {}).error().code,
              Errc::invalid_argument)
        << inside;
  EXPECT_TRUE(copy_store(*open_store(tiles), tiles + "2", {}));
  // Hashes of blocks that are damaged would be sealed as sound.
  std::ofstream(tiles + "/tind-blocks-" + blocks.digest()) << "damaged";
  EXPECT_EQ(copy_store(*open_store(tiles), folder.file("x.pmtiles"), {}).error().code,
            Errc::bad_data);
}

TEST(CopyStore, WhatIsThereAndCannotBeReadIsNotLeftOut) {
  test::TempDir folder;
  InMemory from;
  DemInfo info;
  info.cols = info.rows = 20;
  SourceBlocks blocks(info);
  blocks.add(0, 0, HeightGrid(20, 20));
  from.made->heights = blocks.digest(), from.blocks = blocks.encode();
  const std::string tiles = folder.file("tiles");
  ASSERT_TRUE(copy_store(from, tiles, {}));
  const std::string kept = tiles + "/tind-blocks-" + blocks.digest();
  std::filesystem::remove(kept);
  std::filesystem::create_symlink(kept, kept);  // round in a circle: also root cannot open it
  EXPECT_EQ(copy_store(*open_store(tiles), folder.file("x.pmtiles"), {}).error().code, Errc::io);
  std::filesystem::remove(kept);
  EXPECT_TRUE(copy_store(*open_store(tiles), folder.file("x.pmtiles"), {})) << "there are none";
}

/// 4 MB of zeros are 5 kB as gzip, and would be a directory of a million tiles.
TEST(PmtilesStore, ADirectoryIsNoLargerThanItHasToBe) {
  test::TempDir folder;
  const std::vector<std::uint8_t> zeros((4u << 20) + 1);
  const auto leaf = deflate<std::string>(zeros, Wrapping::gzip, 9);
  const auto pack = [](const std::string& text) {
    return deflate<std::string>(ByteView(text), Wrapping::gzip, 9);
  };
  const proto::PmtilesEntry entry{0, 0, std::uint32_t(leaf.size()), 0};
  const std::string root = pack(proto::encode_pmtiles_directory({&entry, 1}));
  nlohmann::json said;
  said["tind:layer"] = kLayer;
  const std::string metadata = pack(said.dump());
  proto::PmtilesHeader h;
  h.root = {proto::kPmtilesHeaderBytes, root.size()};
  h.metadata = {h.root.end(), metadata.size()};
  h.leaves = {h.metadata.end(), leaf.size()};
  h.tiles = {h.leaves.end(), 1};
  h.max_zoom = 5;
  const std::string path = folder.file("bomb.pmtiles");
  std::ofstream(path, std::ios::binary)
      << proto::encode_pmtiles_header(h) << root << metadata << leaf << "x";
  const auto store = open_store(path);
  ASSERT_TRUE(store->layer_json());
  const auto tile = store->read({0, 0, 0});
  ASSERT_FALSE(tile);
  EXPECT_EQ(tile.error().code, Errc::bad_data);
  EXPECT_THAT(tile.error().what, HasSubstr("too large"));
}

/// Nobody else waits for it.
TEST(MbtilesStore, AViewWithoutEndIsGivenUp) {
  test::TempDir folder;
  const std::string path = folder.file("a.mbtiles");
  ASSERT_TRUE(copy_store(InMemory(), path, {}));
  {
    auto db = Sqlite::open(path, Sqlite::Open::write);
    ASSERT_TRUE(db);
    ASSERT_TRUE(db->run(
        "DELETE FROM metadata WHERE name = 'tind:seal';"
        "ALTER TABLE tiles RENAME TO t0; CREATE VIEW "
        "tiles AS SELECT t0.zoom_level, t0.tile_column, t0.tile_row, t0.tile_data FROM t0, (WITH "
        "RECURSIVE r(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM r) SELECT n FROM r) q WHERE q.n < "
        "0"));
  }
  const auto store = open_store(path);
  for (const TileId id : kTiles) {
    const auto tile = store->read(id);
    ASSERT_FALSE(tile);
    EXPECT_EQ(tile.error().code, Errc::io) << "no client's fault: " << tile.error().what;
    EXPECT_THAT(tile.error().what, HasSubstr("takes too long"));
  }
}

TEST(CopyStore, NamesSayWhatIsAnArchive) {
  test::TempDir folder;
  EXPECT_TRUE(names_archive("a.pmtiles"));
  EXPECT_TRUE(names_archive("a/b.mbtiles"));
  EXPECT_TRUE(names_store("a.pmtiles"));
  EXPECT_FALSE(names_archive("a.tif"));
  EXPECT_TRUE(names_archive("https://a.b/c.pmtiles"));
  EXPECT_FALSE(names_archive("https://a.b/c.mbtiles")) << "cannot be read by ranges";
  fs::create_directories(folder.file("tiles.pmtiles"));
  EXPECT_FALSE(names_archive(folder.file("tiles.pmtiles")));
  EXPECT_EQ(lock_store("a.pmtiles").error().code, Errc::invalid_argument);
  EXPECT_FALSE(fs::exists("a.pmtiles"));
}

}  // namespace
}  // namespace tind
