// Tiles in an object store, copied there and read back while the store breaks: the same bytes, or
// an error, and nothing half made that a reader would take for whole.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "terrain/base/file_io.h"
#include "terrain/check/verify_store.h"
#include "terrain/geo/tile_order.h"
#include "terrain/raster/source_blocks.h"
#include "terrain/store/copy/copy_store.h"
#include "terrain/store/object/object_names.h"
#include "terrain/store/open/open_store.h"
#include "terrain/store/open/stored_tiles.h"
#include "terrain/store/tile_writer.h"
#include "tests/support/made_up_tiles.h"
#include "tests/support/s3_stub.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using Fault = S3Stub::Fault;
using testing::HasSubstr;

constexpr const char* kLayer =
    R"({"format": "quantized-mesh-1.0", "scheme": "tms", "tiles": ["{z}/{x}/{y}.terrain"],
 "projection": "EPSG:4326", "version": "1.0.0", "name": "a hill",
 "available": [[{"startX": 0, "startY": 0, "endX": 1, "endY": 0}],
  [{"startX": 0, "startY": 0, "endX": 3, "endY": 1}],
  [{"startX": 0, "startY": 0, "endX": 7, "endY": 3}]]})";

/// Hashes of the blocks of level ground.
SourceBlocks blocks_of(float height) {
  DemInfo info;
  info.cols = info.rows = 20;
  SourceBlocks blocks(info);
  blocks.add(0, 0, HeightGrid(20, 20, height));
  return blocks;
}

/// Tiles in memory, as another program's store; with a record, so that what is there is told.
class InMemory : public TileStore {
 public:
  explicit InMemory(float height = 0)
      : heights(blocks_of(height).digest()), blocks(blocks_of(height).encode()) {}
  std::string name() const override { return "memory"; }
  std::string layer_name() const override { return "layer"; }
  std::string tile_name(TileId id) const override { return id.text(); }
  bool remote() const override { return false; }
  Result<std::vector<std::uint8_t>> layer_json() const override {
    const std::string text = kLayer;
    return std::vector<std::uint8_t>(text.begin(), text.end());
  }
  Result<std::optional<BuildRecord>> record() const override {
    BuildRecord made;
    made.heights = heights;
    return made;
  }
  Result<std::string> kept_blocks() const override { return blocks; }
  Result<std::vector<std::uint8_t>> read(TileId id) const override {
    const std::string text = id.text() + " of " + heights + std::string(300, 'x');
    return std::vector<std::uint8_t>(text.begin(), text.end());
  }
  Result<StoredTile> look_at(TileId id) const override {
    return StoredTile{*read(id), Vouched::yes, TileFacts{0, 2.5, 0.5, false}};
  }
  const std::string heights, blocks;
};

constexpr int kTiles = 2 + 8 + 32;

std::vector<TileId> all_tiles() {
  std::vector<TileId> ids;
  for (int z = 0; z < 3; ++z)
    for (std::uint32_t x = 0; x < 2u << z; ++x)
      for (std::uint32_t y = 0; y < 1u << z; ++y) ids.push_back({z, x, y});
  return ids;
}

class ObjectStoreTest : public testing::TestWithParam<const char*> {
 protected:
  S3Stub stub;
  S3Environment environment{stub, 20, 2};
  InMemory source;

  std::string place() const { return GetParam(); }
  Result<CopyReport> copy(bool force = false) {
    return copy_store(source, place(), {.force = force, .threads = 4});
  }
  /// Every tile is the source's, or (with `broken`) an error that is no absence.
  void expect_tiles(bool broken = false) {
    const auto store = open_store(place());
    int wrong = 0, failed = 0;
    for (const TileId id : all_tiles()) {
      auto read = store->read(id);
      if (read && !gunzip(*read)) ++wrong;
      if (!read) {
        ++failed;
        EXPECT_NE(read.error().code, Errc::not_found) << read.error().what;
      } else if (*read != *source.read(id)) {
        ++wrong;
      }
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_TRUE(broken || failed == 0) << failed;
  }
};

INSTANTIATE_TEST_SUITE_P(Kinds, ObjectStoreTest,
                         testing::Values("s3://bucket/tiles", "s3://bucket/a/b.pmtiles"));

TEST_P(ObjectStoreTest, WhatGoesInComesOut) {
  const auto report = copy();
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->tiles, std::uint64_t(kTiles));
  expect_tiles();
  const auto store = open_store(place());
  EXPECT_TRUE(store->remote());
  EXPECT_EQ(encode(**store->record()), encode(**source.record()));
  EXPECT_TRUE(store->kept_blocks().value_or("") == source.blocks);
  EXPECT_TRUE(store->generation());
  const auto tile = store->look_at({2, 3, 1});
  ASSERT_TRUE(tile);
  EXPECT_EQ(tile->vouched, Vouched::yes);
  EXPECT_EQ(tile->facts->max_error_m, 2.5);
  EXPECT_EQ(store->read({3, 0, 0}).error().code, Errc::not_found);
  const auto verified = verify_store(*store, 4);
  ASSERT_TRUE(verified) << verified.error().what;
  EXPECT_TRUE(verified->ok());
  EXPECT_EQ(verified->sound, std::uint64_t(kTiles));
  EXPECT_TRUE(names_store(place()));
  EXPECT_FALSE(names_store("s3://bucket/dem.tif"));
}

TEST_P(ObjectStoreTest, ReadsThatBreakAreErrorsAndPass) {
  ASSERT_TRUE(copy());
  for (const Fault fault :
       {Fault::e500, Fault::e403, Fault::reset, Fault::cut, Fault::short_body, Fault::other_body,
        Fault::no_range, Fault::wrong_range, Fault::error_200, Fault::no_length, Fault::redirect}) {
    SCOPED_TRACE(int(fault));
    stub.fail_next("GET", fault, 6);
    expect_tiles(true);
    stub.mend();
    // Opening while all breaks: an error, and none that says that there is nothing.
    stub.fail_next("GET", fault, 1000);
    const auto opened = open_stored_tiles(place());
    EXPECT_TRUE(opened || opened.error().code != Errc::not_found) << opened.error().what;
    stub.mend();
    expect_tiles();
  }
}

TEST_P(ObjectStoreTest, ACopyThatFailsGoesOnAndNobodyTakesItForWhole) {
  for (const Fault fault :
       {Fault::e500, Fault::e403, Fault::reset, Fault::lie, Fault::half_done, Fault::error_200}) {
    for (const char* kind : {"PUT", "HEAD"}) {
      if (std::string(kind) == "HEAD" && (fault == Fault::lie || fault == Fault::half_done))
        continue;
      SCOPED_TRACE(kind + std::to_string(int(fault)));
      for (const auto& [path, bytes] : stub.objects()) stub.erase(path);
      const bool archive = place().ends_with(".pmtiles");
      stub.fail_next(kind, fault, 1000, archive ? "" : "2/3/");
      EXPECT_FALSE(copy());
      EXPECT_FALSE(stub.objects().contains("bucket/tiles/layer.json"));
      stub.mend();
      // What a store made of an archive is not what tind put there, so that it is not tind's to
      // replace.
      if (archive && fault == Fault::half_done) {
        EXPECT_FALSE(copy());
        stub.erase("bucket/a/b.pmtiles");
      }
      const auto again = copy();
      ASSERT_TRUE(again) << again.error().what;
      EXPECT_TRUE(archive || kind != std::string("PUT") || again->kept > 0);
      expect_tiles();
    }
  }
  EXPECT_EQ(stub.wrong_digests(), 0);
}

TEST_P(ObjectStoreTest, LostAnswersLoseNothing) {
  stub.fail_next("PUT", Fault::lost, 1000);
  const auto report = copy();
  ASSERT_TRUE(report) << report.error().what;
  expect_tiles();
}

TEST_P(ObjectStoreTest, BitRotIsFoundAndNeverGiven) {
  ASSERT_TRUE(copy());
  const bool archive = place().ends_with(".pmtiles");
  const std::string path = archive ? "bucket/a/b.pmtiles" : "bucket/tiles/2/3/1.terrain";
  std::string bytes = stub.objects().at(path);
  const std::string sound = bytes;
  bytes[archive ? bytes.size() / 3 : 10] ^= 4;
  stub.put(path, bytes);
  const auto verified = verify_store(*open_store(place()), 2);
  EXPECT_TRUE(!verified || !verified->ok());
  expect_tiles(true);
  stub.put(path, sound.substr(0, sound.size() - 20));
  const auto shorter = verify_store(*open_store(place()), 2);
  EXPECT_TRUE(!shorter || !shorter->ok());
  stub.put(path, sound);
  expect_tiles();
}

TEST_P(ObjectStoreTest, AnotherBuildInItsPlaceIsNeverMixedIn) {
  ASSERT_TRUE(copy());
  const auto store = open_store(place());
  const auto first = store->generation();
  ASSERT_TRUE(store->read({2, 0, 0}));
  InMemory newer(7);
  EXPECT_FALSE(copy_store(newer, place(), {.threads = 2}) && !place().ends_with(".pmtiles"))
      << "objects are not updated in place";
  ASSERT_TRUE(copy_store(newer, place(), {.force = true, .threads = 2}));
  for (const TileId id : all_tiles()) {
    auto read = store->read(id);
    if (!read) {
      EXPECT_EQ(read.error().code, Errc::busy) << read.error().what;
      continue;
    }
    ASSERT_TRUE(gunzip(*read));
    EXPECT_EQ(*read, *source.read(id));  // what was read before the other came
  }
  EXPECT_NE(open_store(place())->generation(), first);
}

TEST(ObjectFolder, WhatTindDidNotMakeStays) {
  S3Stub stub;
  const S3Environment environment(stub, 20, 3);
  stub.put("bucket/tiles/readme.txt", "mine");
  InMemory source;
  const auto refused = copy_store(source, "s3://bucket/tiles", {.force = true});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, HasSubstr("readme.txt"));
  EXPECT_EQ(stub.objects().size(), 1u);
}

/// Before the first one, not when all are there and nobody can read what vouches for them.
TEST(ObjectFolder, MoreTilesThanALedgerHasRoomForAreRefused) {
  S3Stub stub;
  S3Environment environment{stub, 20, 2};
  std::vector<TileArea> areas(13);
  const TileRange all{0, 0, tiling::columns(12) - 1, tiling::rows(12) - 1};
  areas[12] = TileArea({all});
  const TileOrder ids(areas, 12, 12);
  std::vector<std::vector<proto::TileRange>> levels(13);
  levels[12] = {{all.west, all.south, all.east, all.north}};
  const TileWork work{.ids = ids, .levels = levels, .record = {}, .blocks = {}, .changes = {}};
  auto place = lock_store("s3://bucket/large");
  ASSERT_TRUE(place);
  const auto writer = (*place)->claim(work, {});
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().code, Errc::out_of_range);
  EXPECT_THAT(writer.error().what, HasSubstr("33554432 tiles are more than the 1677"));
}

TEST(ObjectFolder, AFolderThatAnybodyCopiedThereIsRead) {
  S3Stub stub;
  const S3Environment environment(stub, 20, 3);
  InMemory source;
  const test::TempDir folder;
  ASSERT_TRUE(copy_store(source, folder.file("tiles"), {}));
  namespace fs = std::filesystem;
  const fs::path top = folder.file("tiles");
  for (const auto& file : fs::recursive_directory_iterator(top))
    if (file.is_regular_file())
      stub.put("bucket/deep/down/" + file.path().lexically_relative(top).string(),
               *read_whole_file(file.path().string()));
  const auto store = open_store("s3://bucket/deep/down/layer.json");
  for (const TileId id : all_tiles()) EXPECT_EQ(*store->read(id), *source.read(id));
  const auto verified = verify_store(*store, 2);
  ASSERT_TRUE(verified);
  EXPECT_TRUE(verified->ok());
}

TEST(ObjectFolder, TilesThatLayerJsonNoLongerNamesAreNotLeftOut) {
  S3Stub stub;
  const S3Environment environment(stub, 20, 3);
  InMemory source;
  ASSERT_TRUE(copy_store(source, "s3://bucket/tiles", {}));
  const test::TempDir folder;
  ASSERT_TRUE(copy_store(*open_store("s3://bucket/tiles"), folder.file("all"), {}));
  std::string layer = kLayer;
  const std::size_t at = layer.find("\"endX\": 7");
  ASSERT_NE(at, layer.npos);
  layer.replace(at, 9, "\"endX\": 6");
  stub.put("bucket/tiles/layer.json", layer);
  const auto copied = copy_store(*open_store("s3://bucket/tiles"), folder.file("fewer"), {});
  ASSERT_FALSE(copied);
  EXPECT_EQ(copied.error().code, Errc::bad_data) << copied.error().what;
}

TEST(RemoteArchive, OfAPlainWebServer) {
  S3Stub stub;
  const S3Environment environment(stub, 20, 3);
  InMemory source;
  ASSERT_TRUE(copy_store(source, "s3://bucket/x.pmtiles", {}));
  const auto store = open_store(stub.address() + "/bucket/x.pmtiles");
  for (const TileId id : all_tiles()) {
    auto read = store->read(id);
    ASSERT_TRUE(read) << read.error().what;
    ASSERT_TRUE(gunzip(*read));
    EXPECT_EQ(*read, *source.read(id));
  }
  EXPECT_FALSE(copy_store(source, stub.address() + "/bucket/y.pmtiles", {}));
  EXPECT_FALSE(copy_store(source, stub.address() + "/bucket/y", {}));
}

}  // namespace
}  // namespace tind
