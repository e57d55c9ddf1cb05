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
#include "terrain/surface/open_surface.h"
#include "tests/support/layered_world.h"
#include "tests/support/made_up_source.h"
#include "tests/support/shapes_file.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class Repair : public testing::Test {
 protected:
  const test::MadeUpSource source_{test::terrain_with_voids(180, 150, 6), {7.123, 46.9}, 0.0013};
  const test::TempDir dir_;
  const std::string folder_ = dir_.file("tiles");

  void SetUp() override { ASSERT_TRUE(build(source_, folder_)); }
  static Result<BuildReport> build(const Surface& surface, const std::string& folder) {
    BuildOptions o;
    o.output = folder;
    o.tiles.effort = Effort::fast;
    return build_tiles(surface, o);
  }
  std::map<std::string, std::string> files() const { return files_in(folder_); }
  static std::map<std::string, std::string> files_in(const std::string& folder) {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
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
  static void lose_a_tile(const std::string& folder) {
    const auto files = files_in(folder);
    const auto tile = std::ranges::find_if(
        files, [](const auto& file) { return file.first.ends_with(".terrain"); });
    ASSERT_NE(tile, files.end());
    fs::remove(tile->first);
  }
  /// What it says where it makes nothing.
  static std::string refusal(const Surface& surface, const std::string& folder) {
    const auto before = files_in(folder);
    const auto report = repair_tiles(surface, folder, 2);
    EXPECT_TRUE(files_in(folder) == before);
    if (report) return "it made " + std::to_string(report->made);
    EXPECT_EQ(report.error().code, Errc::invalid_argument);
    return report.error().what;
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

// Level posts are other heights, though nobody changed the file: the advice for that would lead
// nowhere.
TEST_F(Repair, OfOtherLinesOrWaterItNamesTheirOptions) {
  test::ShapesFile lake("repair-lake"), pond("repair-pond");
  lake.polygon({test::square(7.2, 46.8, 0.03)}).write();
  pond.polygon({test::square(7.27, 46.8, 0.02)}).write();
  ShapeFiles none, water, level, both, other;
  water.water = both.water = {lake.write()};
  level.flatten = both.flatten = {lake.write()};
  other.flatten = {pond.write()};
  const auto shaped = [&](const ShapeFiles& shapes) {
    auto surface = shaped_surface(source_, shapes);
    EXPECT_TRUE(surface) << surface.error().what;
    return *surface;
  };
  struct Case {
    std::string name;
    const ShapeFiles &was, &is;
    testing::Matcher<std::string> says;
  };
  const Case cases[] = {
      {"level", level, none, HasSubstr("repeat --breaklines and --flatten")},
      {"both", both, water, HasSubstr("repeat --breaklines and --flatten")},
      {"other", level, other, HasSubstr("other lines, polygons or water")},
      {"water", water, none, AllOf(HasSubstr("--water"), Not(HasSubstr("--flatten")))},
      {"less", water, both, HasSubstr("leave --breaklines and --flatten out")},
      {"none", none, water, HasSubstr("--water out")}};
  for (const Case& c : cases) {
    const std::string folder = dir_.file(c.name);
    ASSERT_TRUE(build(shaped(c.was), folder)) << c.name;
    const auto before = files_in(folder);
    lose_a_tile(folder);
    EXPECT_THAT(refusal(shaped(c.is), folder), AllOf(c.says, Not(HasSubstr("heights are others"))))
        << c.name;
    const auto mended = repair_tiles(shaped(c.was), folder, 2);
    ASSERT_TRUE(mended) << mended.error().what;
    EXPECT_TRUE(files_in(folder) == before) << c.name;
  }
}

TEST_F(Repair, OfLayersItNamesTheOptionThatIsMissing) {
  const auto low = test::made(test::rough_terrain(60, 50, 1, 2000), {10, 50}, 0.02);
  const auto high = test::made(test::rough_terrain(90, 90, 3, 800), {10.3, 49.7}, 0.004);
  const auto layers = [&](double blend_m, double error_m) {
    return *Surface::of_layers({{"low", low, -1, error_m}, {"high", high, blend_m}});
  };
  const Surface plain = layers(-1, 0), told = layers(1000.5, 50);
  const std::string folder = dir_.file("layers"), as_it_comes = dir_.file("plain");
  ASSERT_TRUE(build(told, folder));
  ASSERT_TRUE(build(plain, as_it_comes));
  const auto before = files_in(folder);
  lose_a_tile(folder);
  lose_a_tile(as_it_comes);
  EXPECT_THAT(refusal(plain, folder),
              AllOf(HasSubstr("--blend high=1000.5"), HasSubstr("--layer-error low=50"),
                    Not(HasSubstr("lie elsewhere"))));
  EXPECT_THAT(refusal(layers(1000.5, 0), folder),
              AllOf(HasSubstr("--layer-error low=50"), Not(HasSubstr("--blend"))));
  EXPECT_THAT(refusal(layers(-1, 50), as_it_comes), HasSubstr("leave its --layer-error out"));
  EXPECT_THAT(refusal(Surface(low), folder), HasSubstr("made of 2 layers, not of 1 layer"));
  const auto elsewhere = test::made(test::rough_terrain(90, 90, 3, 800), {10.4, 49.7}, 0.004);
  EXPECT_THAT(
      refusal(*Surface::of_layers({{"low", low, -1, 50}, {"high", elsewhere, 1000.5}}), folder),
      AllOf(HasSubstr("the posts of layer high lie elsewhere"), Not(HasSubstr("layer low"))));
  const auto mended = repair_tiles(told, folder, 2);
  ASSERT_TRUE(mended) << mended.error().what;
  EXPECT_TRUE(files_in(folder) == before);
}

}  // namespace
}  // namespace tind
