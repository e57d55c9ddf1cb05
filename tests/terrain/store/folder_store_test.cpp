// A folder that is written and read by way of the two contracts alone.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <set>

#include "terrain/geo/tile_order.h"
#include "terrain/raster/source_blocks.h"
#include "terrain/store/folder/folder_aside.h"
#include "terrain/store/folder/folder_contents.h"
#include "terrain/store/folder/folder_files.h"
#include "terrain/store/folder/tile_ledger.h"
#include "terrain/store/open/open_store.h"
#include "tests/support/as_somebody_else.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using test::AsSomebodyElse;
using test::Closed;
using testing::ElementsAre;
using testing::IsEmpty;

std::string text_of(const Result<std::vector<std::uint8_t>>& bytes) {
  return bytes ? std::string(bytes->begin(), bytes->end()) : bytes.error().what;
}

/// Two tiles of level 0 and one of level 1, of a source of 20 x 20 posts.
class FolderStoreTest : public testing::Test {
 protected:
  FolderStoreTest() : areas_{TileArea({{0, 0, 1, 0}}), TileArea({{2, 1, 2, 1}})} {}

  static SourceBlocks blocks(float height) {
    DemInfo info;
    info.cols = info.rows = 20;
    SourceBlocks blocks(info);
    HeightGrid grid(20, 20);
    std::ranges::fill(grid.values(), height);
    blocks.add(0, 0, grid);
    return blocks;
  }
  /// Writes those tiles that are not finished; `mark` is in each. Gives how many those were.
  int write(float height, const std::string& mark) {
    const SourceBlocks heights = blocks(height);
    const TileOrder ids(areas_, 0, 1);
    TileWork work{.ids = ids,
                  .levels = {{{0, 0, 1, 0}}, {{2, 1, 2, 1}}},
                  .record = {},
                  .blocks = {heights.digest(), [&] { return heights.encode(); }},
                  .changes = [&](const BuildRecord& old,
                                 std::string_view old_blocks) -> Result<std::vector<std::uint8_t>> {
                    EXPECT_EQ(old_blocks, old_heights_);
                    EXPECT_NE(old.heights, heights.digest());
                    return std::vector<std::uint8_t>{1, 0, 0};  // the deepest level is first
                  }};
    work.record.heights = heights.digest();
    const auto locked = lock_store(path());
    EXPECT_TRUE(locked) << locked.error().what;
    EXPECT_EQ(lock_store(path()).error().code, Errc::busy);
    const auto writer = (*locked)->claim(work);
    EXPECT_TRUE(writer) << writer.error().what;
    int written = 0;
    for (std::size_t k = 0; k < ids.size(); ++k) {
      if (const auto there = (*writer)->finished(k)) {
        EXPECT_EQ(there->max_error_m, double(k));
        continue;
      }
      EXPECT_TRUE((*writer)->write(k, ids[k].text() + mark, {.max_error_m = double(k)}));
      ++written;
    }
    EXPECT_TRUE((*writer)->finish("{}"));
    old_heights_ = heights.encode();
    return written;
  }
  std::string path() const { return folder_.file("tiles"); }
  /// What a build of such heights says before its first tile; none is made.
  Result<void> begin(float height, bool force = false) const {
    const SourceBlocks heights = blocks(height);
    const TileOrder ids(areas_, 0, 1);
    TileWork work{
        .ids = ids,
        .levels = {{{0, 0, 1, 0}}, {{2, 1, 2, 1}}},
        .record = {},
        .blocks = {heights.digest(), [&] { return heights.encode(); }},
        .changes = [](const BuildRecord&, std::string_view) -> Result<std::vector<std::uint8_t>> {
          return std::vector<std::uint8_t>{1, 0, 0};
        },
        .force = force};
    work.record.heights = heights.digest();
    const auto locked = lock_store(path());
    if (!locked) return std::unexpected(locked.error());
    const auto writer = (*locked)->claim(work);
    return writer ? Result<void>() : std::unexpected(writer.error());
  }

  test::TempDir folder_;
  std::array<TileArea, 2> areas_;
  std::string old_heights_;
};

TEST_F(FolderStoreTest, WhatIsWrittenIsRead) {
  EXPECT_EQ(write(1, " a"), 3);
  for (const std::string& name : {path(), path() + "/", path() + "/layer.json"}) {
    const auto store = open_store(name);
    EXPECT_EQ(store->name(), path());
    EXPECT_EQ(text_of(store->layer_json()), "{}");
    EXPECT_EQ(text_of(store->read({1, 2, 1})), "1/2/1 a");
    const auto tile = store->look_at({0, 1, 0});
    ASSERT_TRUE(tile);
    EXPECT_EQ(tile->vouched, Vouched::yes);
    EXPECT_EQ(store->size({0, 1, 0}), 7u);
    EXPECT_EQ(store->read({1, 0, 0}).error().code, Errc::not_found);
    EXPECT_FALSE(store->size({1, 0, 0}).value());
    EXPECT_FALSE(store->remote());
    EXPECT_TRUE(store->vouched_for());
    EXPECT_THAT(store->faults(), IsEmpty());
    const auto record = store->record();
    ASSERT_TRUE(record && *record);
    EXPECT_EQ((*record)->heights, blocks(1).digest());
  }
  EXPECT_EQ(write(1, " b"), 0) << "all are finished";
}

TEST_F(FolderStoreTest, AnUpdateWritesWhatChangedAndIsAnotherGeneration) {
  write(1, " a");
  const auto before = open_store(path());
  EXPECT_EQ(write(2, " b"), 1);
  const auto after = open_store(path());
  EXPECT_EQ(text_of(after->read({1, 2, 1})), "1/2/1 b");
  EXPECT_EQ(text_of(after->read({0, 0, 0})), "0/0/0 a");
  ASSERT_TRUE(before->generation());
  EXPECT_NE(before->generation(), after->generation());
  // The one that was opened before gives no tile of the other build.
  EXPECT_EQ(before->read({1, 2, 1}).error().code, Errc::busy);
}

TEST_F(FolderStoreTest, TilesThatAreNotAsTheyWereWrittenAreSeenAndNotRead) {
  write(1, " a");
  std::ofstream(path() + "/0/0/0.terrain") << "0/0/0 x";
  fs::create_directories(path() + "/1/3");
  std::ofstream(path() + "/1/3/1.terrain") << "another's";
  const auto store = open_store(path());
  EXPECT_EQ(store->read({0, 0, 0}).error().code, Errc::io);
  const auto changed = store->look_at({0, 0, 0}), foreign = store->look_at({1, 3, 1});
  ASSERT_TRUE(changed && foreign);
  EXPECT_EQ(text_of(changed->bytes), "0/0/0 x");
  EXPECT_EQ(changed->vouched, Vouched::other_bytes);
  EXPECT_EQ(foreign->vouched, Vouched::not_listed);
  fs::remove(path() + "/tind-tiles.ledger");
  const auto without = open_store(path());
  EXPECT_EQ(text_of(without->read({0, 0, 0})), "0/0/0 x");
  EXPECT_EQ(without->look_at({0, 0, 0})->vouched, Vouched::by_nobody);
  EXPECT_FALSE(without->generation());
}

TEST_F(FolderStoreTest, AListIsWhatLiesThere) {
  write(1, " a");
  std::ofstream(path() + "/1/2/x.terrain") << "";
  fs::create_directories(path() + "/tind-update/0/5");
  std::ofstream(path() + "/tind-update/0/5/5.terrain") << "";
  const auto listed = open_store(path())->list();
  ASSERT_TRUE(listed && *listed);
  EXPECT_THAT((*listed)->levels, ElementsAre(ElementsAre(TileId{0, 0, 0}, TileId{0, 1, 0}),
                                             ElementsAre(TileId{1, 2, 1})));
  EXPECT_THAT((*listed)->strays, ElementsAre("1/2/x.terrain"));
  EXPECT_EQ(open_store(folder_.file("none"))->list().error().code, Errc::not_found);
}

TEST_F(FolderStoreTest, APartOfAListingIsNone) {
  write(1, "a");
  const fs::path closed = path() + "/1";
  fs::permissions(fs::path(path()).parent_path(), fs::perms(0755));
  fs::permissions(closed, fs::perms::none);
  {
    const AsSomebodyElse nobody;
    const auto listed = open_store(path())->list();
    ASSERT_FALSE(listed) << "what was seen of it is not all there is";
    EXPECT_EQ(listed.error().code, Errc::io);
  }
  fs::permissions(closed, fs::perms(0755));
  EXPECT_TRUE(open_store(path())->list());
}

TEST_F(FolderStoreTest, WithARecordThatCannotBeReadNothingIsKnownOfIt) {
  write(1, "a");
  const fs::path record = path() + "/tind-build.json", aside = path() + "/aside";
  fs::rename(record, aside);
  EXPECT_EQ(*open_store(path())->record(), std::nullopt);
  fs::create_symlink("tind-build.json", record);  // a loop, which nobody can open
  const auto store = open_store(path());
  ASSERT_FALSE(store->record());
  EXPECT_EQ(store->record().error().code, Errc::io);
  EXPECT_FALSE(store->list()) << "whose the files beside the tiles are, the record says";
  fs::remove(record);
  fs::rename(aside, record);
  EXPECT_TRUE(*open_store(path())->record());
}

TEST_F(FolderStoreTest, ATileThatCannotBeLookedAtIsNotTakenForGone) {
  write(1, "a");
  const auto ledger = TileLedger::open(path() + "/tind-tiles.ledger");
  ASSERT_TRUE(ledger);
  FolderFiles files;
  const auto remove_all = [&] {
    return folder::remove_tiles(files, path(), *ledger, [](TileId) { return true; });
  };
  const fs::path closed = path() + "/1";
  fs::permissions(fs::path(path()).parent_path(), fs::perms(0777));
  fs::permissions(path(), fs::perms(0777));
  fs::permissions(path() + "/0", fs::perms(0777));
  for (const char* column : {"/0/0", "/0/1"}) fs::permissions(path() + column, fs::perms(0777));
  fs::permissions(closed, fs::perms::none);
  {
    const AsSomebodyElse nobody;
    const auto removed = remove_all();
    ASSERT_FALSE(removed) << "an old tile would stay";
    EXPECT_EQ(removed.error().code, Errc::io);
  }
  fs::permissions(closed, fs::perms(0755));
  EXPECT_TRUE(fs::exists(closed / "2/1.terrain"));
  EXPECT_TRUE(remove_all());
  EXPECT_FALSE(fs::exists(closed));
}

TEST_F(FolderStoreTest, WhatIsDamagedBesideTheTilesIsNamed) {
  write(1, " a");
  const std::string blocks_file = "tind-blocks-" + blocks(1).digest();
  std::ofstream(path() + "/" + blocks_file) << "TNSB";
  std::ofstream(path() + "/tind-tiles.ledger") << "tindTLG\n";
  const auto store = open_store(path());
  EXPECT_EQ(store->vouched_for().error().code, Errc::bad_data);
  const auto faults = store->faults();
  ASSERT_EQ(faults.size(), 2u);
  EXPECT_EQ(faults[0].in, StoreFault::In::ledger);
  EXPECT_EQ(faults[0].name, "tind-tiles.ledger");
  EXPECT_EQ(faults[1].in, StoreFault::In::blocks);
  EXPECT_EQ(faults[1].name, blocks_file);
}

TEST_F(FolderStoreTest, APipeInTheWayKeepsNobodyWaiting) {
  write(1, " a");
  for (const char* name : {"/tind-tiles.ledger", "/tind-build.json"}) {
    fs::remove(path() + name);
    ASSERT_EQ(mkfifo((path() + name).c_str(), 0666), 0);
  }
  EXPECT_FALSE(open_store(path())->faults().empty());
  const SourceBlocks heights = blocks(1);
  const TileOrder ids(areas_, 0, 1);
  const TileWork work{.ids = ids,
                      .levels = {},
                      .record = {},
                      .blocks = {heights.digest(), [&] { return heights.encode(); }},
                      .changes = {}};
  const auto locked = lock_store(path());
  ASSERT_TRUE(locked) << locked.error().what;
  EXPECT_FALSE((*locked)->claim(work));
}

TEST_F(FolderStoreTest, ARecordThatCannotBeReadIsNotTakenForNone) {
  write(1, " a");
  const std::string record = path() + "/tind-build.json", ready = path() + folder::kReady;
  fs::rename(record, path() + "/away");
  ASSERT_EQ(mkfifo(record.c_str(), 0666), 0);
  fs::create_directory(ready);  // as an update leaves it that has just moved in
  FolderFiles files;
  const auto adopted = folder::adopt(files, path());
  ASSERT_FALSE(adopted) << "which blocks are the old ones is not known";
  EXPECT_EQ(adopted.error().code, Errc::io);
  EXPECT_TRUE(fs::exists(ready)) << "the next run goes on";
  fs::rename(path() + "/away", record);
  const std::string old = path() + "/tind-blocks-0123456789abcdef0123456789abcdef";
  std::ofstream(old) << "TNSB";
  EXPECT_TRUE(folder::adopt(files, path()));
  EXPECT_FALSE(fs::exists(ready));
  EXPECT_FALSE(fs::exists(old));
}

/// Who is told that it is somebody else's moves it away, or takes --force.
TEST_F(FolderStoreTest, WhatCannotBeReadIsNotTakenForForeign) {
  write(1, "a");
  fs::permissions(fs::path(path()).parent_path(), fs::perms(0755));
  const std::string old_blocks = "/tind-blocks-" + blocks(1).digest();
  test::give_to_somebody(path());
  for (const std::string& name :
       {std::string("/tind-tiles.ledger"), std::string("/tind-build.json"),
        std::string("/layer.json"), old_blocks, std::string("/1"), std::string("/1/2")}) {
    const Closed closed(path() + name);
    const AsSomebodyElse nobody;
    const auto begun = begin(2);
    ASSERT_FALSE(begun) << name;
    EXPECT_EQ(begun.error().code, Errc::io) << begun.error().what;
    if (name == "/layer.json") continue;  // nobody asks what it names
    EXPECT_EQ(begin(2, true).error().code, Errc::io) << name;
  }
  EXPECT_FALSE(fs::exists(path() + folder::kAside)) << "nothing was begun";
  EXPECT_EQ(text_of(open_store(path())->read({1, 2, 1})), "1/2/1a");
}

TEST_F(FolderStoreTest, AnUpdateThatCannotBeReadIsNotTakenForForeign) {
  write(1, "a");
  ASSERT_TRUE(begin(2));
  const std::string aside = path() + folder::kAside, ready = path() + folder::kReady;
  ASSERT_TRUE(fs::exists(aside + folder::kLedger));
  test::give_to_somebody(path());
  FolderFiles files;
  for (const std::string& name :
       {std::string(folder::kLedger), std::string(folder::kRecord), std::string()}) {
    const Closed closed(aside + name);
    const AsSomebodyElse nobody;
    EXPECT_EQ(begin(2).error().code, Errc::io) << name;
    EXPECT_EQ(folder::remove_aside(files, path(), folder::kAside).error().code, Errc::io) << name;
  }
  {
    const AsSomebodyElse nobody;
    EXPECT_TRUE(begin(2)) << "it goes on";
  }
  // Names can be listed there, and what they are cannot be told.
  fs::permissions(aside, fs::perms(0444));
  {
    const AsSomebodyElse nobody;
    EXPECT_EQ(folder::look_aside(path(), folder::kAside).error().code, Errc::io);
  }
  fs::permissions(aside, fs::perms(0755));
  // What proves itself: without a record nothing else does.
  fs::rename(aside, ready);
  fs::remove(ready + folder::kRecord);
  for (const std::string& name :
       {std::string(folder::kLedger), folder::kBlocks + blocks(2).digest()}) {
    ASSERT_TRUE(fs::exists(ready + name));
    const Closed closed(ready + name);
    const AsSomebodyElse nobody;
    EXPECT_EQ(folder::look_aside(path(), folder::kReady).error().code, Errc::io) << name;
    EXPECT_EQ(folder::adopt(files, path()).error().code, Errc::io) << name;
  }
  EXPECT_TRUE(folder::look_aside(path(), folder::kReady));
  {
    const Closed closed(path());
    const AsSomebodyElse nobody;
    EXPECT_EQ(folder::adopt(files, path()).error().code, Errc::io);
  }
  EXPECT_TRUE(fs::exists(ready + folder::kLedger)) << "it may be an update that is whole";
}

TEST_F(FolderStoreTest, WhatIsInTheWayIsToldOnlyOfWhatCanBeSeen) {
  const std::string blocks_name = "/tind-blocks-" + blocks(1).digest();
  fs::create_directories(path() + "/0/0");
  fs::create_directories(path() + folder::kPartial);
  std::ofstream(path() + folder::kPartial + "/0123456789abcdef") << "half";
  std::ofstream(path() + folder::kResiduals) << "tindRIX\n";
  std::ofstream(path() + blocks_name) << "TNSB";
  test::give_to_somebody(path());
  const TileOrder ids(areas_, 0, 1);
  const auto none = [](TileId) { return false; };
  {
    const Closed residuals(path() + folder::kResiduals), hashes(path() + blocks_name);
    const AsSomebodyElse nobody;
    EXPECT_EQ(folder::check_way(path(), ids, false, none).error().code, Errc::io);
    EXPECT_EQ(folder::is_blocks(path() + blocks_name).error().code, Errc::io);
    EXPECT_EQ(folder::check_blocks(path(), blocks(1).digest(), false).error().code, Errc::io);
    EXPECT_TRUE(folder::check_blocks(path(), blocks(1).digest(), true)) << "ours, however damaged";
    EXPECT_EQ(folder::check_places(path(), {blocks_name}).error().code, Errc::io);
  }
  fs::permissions(path() + folder::kPartial, fs::perms(0444));
  {
    const Closed level(path() + "/0");
    const AsSomebodyElse nobody;
    EXPECT_EQ(folder::check_way(path(), ids, false, none).error().code, Errc::io);
    EXPECT_EQ(folder::check_places(path(), {"/0/0/0.terrain"}).error().code, Errc::io);
    EXPECT_EQ(folder::check_partial(path(), true).error().code, Errc::io);
    FolderFiles files;
    EXPECT_EQ(folder::remove_partial_files(files, path()).error().code, Errc::io);
  }
  fs::permissions(path() + folder::kPartial, fs::perms(0755));
  EXPECT_TRUE(folder::check_way(path(), ids, false, none));
  EXPECT_TRUE(folder::check_partial(path(), true));
  EXPECT_TRUE(folder::check_places(path(), {blocks_name, "/0/0/0.terrain"}));
}

TEST_F(FolderStoreTest, ALockThatIsNotOursStays) {
  fs::create_directories(path());
  ASSERT_EQ(mkfifo((path() + "/tind-lock").c_str(), 0666), 0);
  const auto locked = lock_store(path());
  ASSERT_FALSE(locked);
  EXPECT_EQ(locked.error().code, Errc::invalid_argument);
  EXPECT_TRUE(fs::exists(path() + "/tind-lock"));
}

/// A reader tries again what he would else take for gone.
TEST_F(FolderStoreTest, WhatABuildMayYetPutThereIsNotTakenForMissing) {
  write(1, " a");
  const auto store = open_store(path());
  fs::remove(path() + "/layer.json");
  fs::remove(path() + "/1/2/1.terrain");
  const auto expect = [&](Errc code) {
    EXPECT_EQ(store->layer_json().error().code, code);
    EXPECT_EQ(open_store(path())->layer_json().error().code, code);
    EXPECT_EQ(store->read({1, 2, 1}).error().code, code);
    EXPECT_EQ(store->look_at({1, 2, 1}).error().code, code);
    EXPECT_EQ(store->read({1, 0, 0}).error().code, Errc::not_found);  // the ledger lacks it, too
  };
  expect(Errc::not_found);
  {
    const auto building = lock_store(path());
    ASSERT_TRUE(building) << building.error().what;
    expect(Errc::busy);
    EXPECT_THAT(store->layer_json().error().what,
                testing::HasSubstr("another tind (process " + std::to_string(::getpid())));
    EXPECT_EQ(text_of(store->read({0, 1, 0})), "0/1/0 a");
  }
  expect(Errc::not_found);
  // Of a build that was killed: nobody has it.
  std::ofstream(path() + "/tind-lock") << "tind build: process 1 on elsewhere since 2020\n";
  expect(Errc::not_found);
  fs::remove(path() + "/tind-lock");
  ASSERT_EQ(::mkfifo((path() + "/tind-lock").c_str(), 0600), 0);
  expect(Errc::not_found);
}

TEST_F(FolderStoreTest, NoTileSetIsMadeInALevelOfAnother) {
  write(1, " a");
  fs::create_directory_symlink(path() + "/0", folder_.file("link"));
  for (const std::string& within : {path() + "/0", path() + "/0/new", path() + "/7/new/deeper/",
                                    path() + "/../tiles/0/new", folder_.file("link")}) {
    const auto locked = lock_store(within);
    ASSERT_FALSE(locked) << within;
    EXPECT_EQ(locked.error().code, Errc::invalid_argument) << locked.error().what;
  }
  EXPECT_FALSE(fs::exists(path() + "/0/new") || fs::exists(path() + "/7"));
  EXPECT_FALSE(fs::exists(path() + "/0/tind-lock"));
  for (const std::string& beside : {path(), path() + "/", path() + "/new", folder_.file("tiles-2")})
    EXPECT_TRUE(lock_store(beside)) << beside;
}

TEST(PartialPaths, NoTwoWritersShareOneAndAllAreSweptLater) {
  test::TempDir place;
  const std::string tiles = place.file("tiles");
  fs::create_directories(tiles + "/tind-partial");
  std::set<std::string> paths = {tiles + "/tind-partial/0123456789abcdef"};  // an earlier version's
  for (int writer = 0; writer < 3; ++writer) {
    folder::PartialPaths partial(tiles);
    for (int n = 0; n < 3; ++n) EXPECT_TRUE(paths.insert(partial.next()).second);
  }
  for (const std::string& path : paths) std::ofstream(path) << "half";
  EXPECT_FALSE(folder::check_partial(tiles, false))
      << "they are in the way of who never built here";
  EXPECT_TRUE(folder::check_partial(tiles, true));
  FolderFiles files;
  EXPECT_TRUE(folder::remove_partial_files(files, tiles));
  EXPECT_FALSE(fs::exists(tiles + "/tind-partial"));
}

TEST(OpenStore, KnowsTileSetsByTheirNames) {
  EXPECT_TRUE(names_store("http://a.b/c"));
  EXPECT_TRUE(names_store("https://a.b/c/layer.json"));
  EXPECT_TRUE(names_store("/"));
  EXPECT_TRUE(names_store("somewhere/layer.json"));
  EXPECT_TRUE(names_archive("somewhere/X.PMTiles"));
  EXPECT_TRUE(names_archive("somewhere/x.MBTILES"));
  EXPECT_FALSE(names_store("dem.tif"));
  EXPECT_TRUE(open_store("https://a.b/c")->remote());
  EXPECT_FALSE(open_store("dem.tif")->remote());
}

}  // namespace
}  // namespace tind
