// OGC CDB: names by the standard's own examples, geocells of every zone, posts at south-western
// corners, levels that are complete, files that are kept.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "terrain/base/file_io.h"
#include "terrain/heightmaps/cdb_folder.h"
#include "terrain/heightmaps/cdb_tile.h"
#include "terrain/store/folder/folder_lock.h"
#include "terrain/surface/height_field.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind::cdb {
namespace {

namespace fs = std::filesystem;
using test::MadeUpSource;

TEST(CdbTile, NamesAsInTheStandardsExamples) {
  EXPECT_EQ(path({-6, 45, 2, 3, 0}),  // -5.2, 45.2
            "Tiles/S06/E045/001_Elevation/L02/U3/S06E045_D001_S001_T001_L02_U3_R0.tif");
  EXPECT_EQ(path({-6, 45, -6, 0, 0}),
            "Tiles/S06/E045/001_Elevation/LC/U0/S06E045_D001_S001_T001_LC06_U0_R0.tif");
  EXPECT_EQ(path({62, -162, 7, 38, 102}),  // 62.3, -160.4
            "Tiles/N62/W162/001_Elevation/L07/U38/N62W162_D001_S001_T001_L07_U38_R102.tif");
  EXPECT_EQ(path({0, 0, -10, 0, 0}),
            "Tiles/N00/E000/001_Elevation/LC/U0/N00E000_D001_S001_T001_LC10_U0_R0.tif");
}

TEST(CdbTile, TheExamplesPlacesLieInTheirTiles) {
  EXPECT_TRUE(rect({-6, 45, 2, 3, 0}).contains({45.2, -5.2}));
  EXPECT_TRUE(rect({62, -162, 7, 38, 102}).contains({-160.4, 62.3}));
}

TEST(CdbTile, ZonesAreAsWideAsTheTableSays) {
  const std::map<int, int> table = {{-90, 12}, {-89, 6}, {-81, 6}, {-80, 4}, {-76, 4}, {-75, 3},
                                    {-71, 3},  {-70, 2}, {-51, 2}, {-50, 1}, {0, 1},   {49, 1},
                                    {50, 2},   {69, 2},  {70, 3},  {74, 3},  {75, 4},  {79, 4},
                                    {80, 6},   {88, 6},  {89, 12}};
  for (const auto& [lat, width] : table) EXPECT_EQ(width_deg(lat), width) << lat;
}

TEST(CdbTile, PostsLieOnTheWestAndSouthEdge) {
  const Tile tile{46, 7, 1, 0, 1};
  const GeoRect r = rect(tile);
  EXPECT_EQ(r, (GeoRect{7.5, 46, 8, 46.5}));
  const RasterLattice l = lattice(tile);
  EXPECT_EQ(l.cols, 1024);
  std::vector<Geographic> row(1024);
  l.places(1023, 0, row);
  EXPECT_EQ(row.front(), (Geographic{7.5, 46}));
  l.places(0, 0, row);
  EXPECT_NEAR(row.front().lat, 46.5 - .5 / 1024, 1e-12);
  EXPECT_NEAR(row.back().lon, 8 - .5 / 1024, 1e-12);
  EXPECT_EQ(posts(-10), 1);
  EXPECT_EQ(posts(-2), 256);
}

TEST(CdbTile, LevelsAreAsFineAsTheDem) {
  EXPECT_EQ(level_of(30), 2);  // 27 m
  EXPECT_EQ(level_of(108), 0);
  EXPECT_EQ(level_of(1e6), -10);
  EXPECT_EQ(level_of(1), 7);  // .85 m
}

TEST(CdbTile, EveryTileHasItsParent) {
  const auto all = tiles({6.4, 49.7, 8.3, 50.2}, 3);
  std::set<std::string> there;
  for (const Tile& t : all) {
    EXPECT_TRUE(rect(t).overlaps({6.4, 49.7, 8.3, 50.2}));
    if (t.lod > kCoarsest) {
      const Tile parent = t.lod > 0 ? Tile{t.lat, t.lon, t.lod - 1, t.up / 2, t.right / 2}
                                    : Tile{t.lat, t.lon, t.lod - 1, 0, 0};
      EXPECT_TRUE(there.contains(path(parent))) << path(t);
    }
    EXPECT_TRUE(there.insert(path(t)).second);
  }
  // Two rows of geocells: of one degree below 50, of two above.
  std::set<std::pair<int, int>> cells;
  for (const Tile& t : all) cells.insert({t.lat, t.lon});
  EXPECT_EQ(cells, (std::set<std::pair<int, int>>{{49, 6}, {49, 7}, {49, 8}, {50, 6}, {50, 8}}));
}

class CdbFolder : public ::testing::Test {
 protected:
  /// Posts of level 0 across a geocell's corner, so that they are the tiles' posts.
  static constexpr double kStep = 1. / 1024;
  MadeUpSource source_{test::rough_terrain(80, 70, 4), {7 - 40 * kStep, 46 + 30 * kStep}, kStep};
  test::TempDir folder_;

  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path()))
      if (entry.is_regular_file())
        all[entry.path().lexically_relative(folder_.path()).string()] =
            *read_whole_file(entry.path().string());
    return all;
  }
};

TEST_F(CdbFolder, HasThePostsOfTheDemAndNoHoles) {
  const auto made = write_folder(Surface(source_), {.output = folder_.file("cdb"), .deepest = 0});
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_EQ(made->tiles, 4u * 11);
  EXPECT_EQ(made->deepest, 0);
  int found = 0;
  for (const auto& [lat, lon] :
       {std::pair(45, 6), std::pair(45, 7), std::pair(46, 6), std::pair(46, 7)}) {
    const std::string file = folder_.file("cdb/" + path({lat, lon, 0, 0, 0}));
    const auto back = DemSource::open(std::vector<std::string>{file});
    ASSERT_TRUE(back) << back.error().what;
    EXPECT_EQ((*back)->info().cols, 1024);
    EXPECT_EQ((*back)->info().crs_kind, CrsKind::geographic);
    const auto grid = (*back)->read(0, 0, 1024, 1024);
    ASSERT_TRUE(grid);
    for (const float h : grid->values()) ASSERT_FALSE(std::isnan(h));
    for (int r = 1; r < 69; ++r)
      for (int c = 1; c < 79; ++c) {
        const Vec2 p = source_.info().post_to_crs.apply(c, r);
        const int x = int(std::lround((p.x - lon) * 1024));
        const int y = 1023 - int(std::lround((p.y - lat) * 1024));
        if (x < 0 || x > 1023 || y < 0 || y > 1023) continue;
        ++found;
        ASSERT_NEAR(grid->at(x, y), source_.grid().at(c, r), 1e-3) << c << ' ' << r;
      }
  }
  EXPECT_EQ(found, 78 * 68);  // each post in one tile
}

TEST_F(CdbFolder, GoesOnAndRefusesWhatIsNotIts) {
  const std::string out = folder_.file("cdb");
  ASSERT_TRUE(write_folder(Surface(source_), {.output = out, .deepest = -2}));
  const auto whole = files();
  fs::remove(out + "/" + path({46, 7, -4, 0, 0}));
  const auto again = write_folder(Surface(source_), {.output = out, .deepest = -2, .threads = 3});
  ASSERT_TRUE(again);
  EXPECT_EQ(again->kept, again->tiles - 1);
  EXPECT_EQ(files(), whole);

  class Other : public MadeUpSource {
   public:
    using MadeUpSource::MadeUpSource;
    const DemInfo& info() const override {
      other_ = MadeUpSource::info(), other_.fingerprint = "other";
      return other_;
    }
    mutable DemInfo other_;
  } other(test::rough_terrain(20, 20, 9), {7, 46}, kStep);
  const auto refused = write_folder(Surface(other), {.output = out, .deepest = -2});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::invalid_argument);
  EXPECT_EQ(files(), whole);
  fs::create_directory(folder_.path() / "mine");
  std::ofstream(folder_.file("mine/notes")) << "mine";
  EXPECT_FALSE(write_folder(Surface(source_), {.output = folder_.file("mine"), .deepest = -9}));
}

TEST_F(CdbFolder, IsWrittenByOneAtATime) {
  const std::string out = folder_.file("cdb");
  fs::create_directories(out);
  {
    const auto other = FolderLock::take(out);
    ASSERT_TRUE(other);
    const auto busy = write_folder(Surface(source_), {.output = out, .deepest = -9});
    ASSERT_FALSE(busy);
    EXPECT_EQ(busy.error().code, Errc::busy);
    EXPECT_EQ(files().size(), 1u) << "the lock's";
  }
  EXPECT_TRUE(write_folder(Surface(source_), {.output = out, .deepest = -9}));
  EXPECT_FALSE(fs::exists(out + "/tind-lock"));
}

TEST_F(CdbFolder, OfARecordThatCannotBeReadIsNotCalledAnothers) {
  ASSERT_EQ(::mkfifo(folder_.file("tind-cdb.txt").c_str(), 0666), 0);
  const auto failed =
      write_folder(Surface(source_), {.output = folder_.path().string(), .deepest = -9});
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, Errc::io);
}

TEST_F(CdbFolder, GoesOnFromAKillJustBeforeItsRecordWasThere) {
  const std::string left = folder_.file("tind-cdb.txt.partial-0123456789abcdef");
  const FolderOptions options{.output = folder_.path().string(), .deepest = -9};
  std::ofstream(left) << "Elevations";
  std::ofstream(left + "0") << "mine";  // no name that a run gives
  EXPECT_EQ(write_folder(Surface(source_), options).error().code, Errc::invalid_argument);
  EXPECT_TRUE(fs::exists(left));
  fs::remove(left + "0");
  const auto made = write_folder(Surface(source_), options);
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_FALSE(fs::exists(left));
}

TEST_F(CdbFolder, WhatIsCutOffIsMadeAgain) {
  const std::string out = folder_.file("cdb");
  ASSERT_TRUE(write_folder(Surface(source_), {.output = out, .deepest = -2}));
  const auto whole = files();
  for (const int lod : {-2, -10}) {
    const std::string file = out + "/" + path({46, 7, lod, 0, 0});
    const std::uintmax_t size = fs::file_size(file);
    for (const std::uintmax_t left : {std::uintmax_t(0), size / 2, size - 1}) {
      fs::resize_file(file, left);
      const auto again = write_folder(Surface(source_), {.output = out, .deepest = -2});
      ASSERT_TRUE(again) << again.error().what;
      EXPECT_EQ(again->kept, again->tiles - 1) << lod << ' ' << left;
      EXPECT_EQ(files(), whole) << lod << ' ' << left;
    }
  }
}

TEST_F(CdbFolder, WithoutAnyHeightTakesBackItsOwnTilesOnly) {
  const std::string out = folder_.file("cdb");
  HeightGrid none(20, 20);
  std::ranges::fill(none.values(), std::nanf(""));
  const MadeUpSource empty(none, {7, 46}, kStep);
  const FolderOptions options{.output = out, .deepest = -8};
  ASSERT_FALSE(write_folder(Surface(empty), options));
  EXPECT_TRUE(fs::is_empty(out)) << "another DEM may go there";
  const std::string mine = out + "/Tiles/N46/E007/002_MinMaxElevation/mine.tif";
  fs::create_directories(fs::path(mine).parent_path());
  std::ofstream(mine) << "mine";
  const auto refused = write_folder(Surface(empty), options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::invalid_argument);  // a folder of somebody else's
  EXPECT_EQ(*read_whole_file(mine), "mine");
  EXPECT_EQ(files().size(), 1u);
}

}  // namespace
}  // namespace tind::cdb
