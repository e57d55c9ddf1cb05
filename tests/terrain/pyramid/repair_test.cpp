// What broke in a folder or in an archive is what it was, byte for byte, and nothing else is
// touched.

#include "terrain/pyramid/build/repair.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "terrain/base/file_io.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/store/copy/copy_store.h"
#include "terrain/store/open/open_store.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;

class Repair : public testing::Test {
 protected:
  const test::MadeUpSource source_{test::terrain_with_voids(180, 150, 6), {7.123, 46.9}, 0.0013};
  const test::TempDir dir_;
  const std::string folder_ = dir_.file("tiles");

  void SetUp() override {
    BuildOptions o;
    o.output = folder_;
    o.tiles.effort = Effort::fast;
    ASSERT_TRUE(build_tiles(source_, o));
  }
  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      if (entry.is_regular_file())
        all[entry.path().string()] = read_whole_file(entry.path().string()).value_or("?");
    return all;
  }
  /// One bit, `from_end` bytes before the end.
  static void flip(const std::string& path, std::size_t from_end) {
    std::string bytes = read_whole_file(path).value();
    bytes[bytes.size() - from_end] ^= 4;
    std::ofstream(path, std::ios::binary) << bytes;
  }
};

TEST_F(Repair, GivesAFolderBackWhatItHad) {
  const auto before = files();
  std::vector<std::string> tiles;
  for (const auto& [path, bytes] : before)
    if (path.ends_with(".terrain")) tiles.push_back(path);
  ASSERT_GT(tiles.size(), 6u);
  fs::remove(tiles[1]);
  flip(tiles[3], 9);
  fs::resize_file(tiles[5], 100);
  const auto report = repair_tiles(source_, folder_, 2);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->made, 3u);
  EXPECT_EQ(report->tiles, tiles.size());
  EXPECT_TRUE(files() == before);
  const auto again = repair_tiles(source_, folder_, 2);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->made, 0u) << "what is sound stays";
  EXPECT_TRUE(files() == before);
}

TEST_F(Repair, GivesAnArchiveBackWhatItHad) {
  const std::string archive = dir_.file("tiles.pmtiles");
  ASSERT_TRUE(copy_store(*open_store(folder_), archive, {}));
  const std::string before = read_whole_file(archive).value();
  flip(archive, before.size() / 2);  // within a tile
  const auto report = repair_tiles(source_, archive, 2);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->made, 1u);
  EXPECT_TRUE(read_whole_file(archive).value_or("") == before);
}

TEST_F(Repair, OfAnythingElseItMakesNothing) {
  const auto before = files();
  const std::string tile = std::ranges::find_if(before, [](const auto& f) {
                             return f.first.ends_with(".terrain");
                           })->first;
  flip(tile, 9);
  const auto broken = files();
  HeightGrid higher = test::terrain_with_voids(180, 150, 6);
  higher.at(7, 7) = 3000;
  const test::MadeUpSource changed(higher, {7.123, 46.9}, 0.0013, 0, std::string(32, 'f'));
  const test::MadeUpSource elsewhere(test::terrain_with_voids(180, 150, 6), {8, 46.9}, 0.0013);
  for (const auto& [other, why] :
       {std::pair<const test::MadeUpSource&, const char*>{changed, "the heights are others by now"},
        {elsewhere, "the posts lie elsewhere"}}) {
    const auto report = repair_tiles(other, folder_, 2);
    ASSERT_FALSE(report) << why;
    EXPECT_EQ(report.error().code, Errc::invalid_argument);
    EXPECT_THAT(report.error().what, testing::HasSubstr(why));
    EXPECT_TRUE(files() == broken) << why;
  }
  fs::remove(folder_ + "/tind-build.json");
  const auto report = repair_tiles(source_, folder_, 2);
  ASSERT_FALSE(report);
  EXPECT_THAT(report.error().what, testing::HasSubstr("no sound record"));
}

}  // namespace
}  // namespace tind
