// Builds over older builds: what is made again, what stays, and that nobody can tell afterwards.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>

#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/build/repair.h"
#include "terrain/raster/source_blocks.h"
#include "terrain/store/copy/copy_store.h"
#include "terrain/store/open/open_store.h"
#include "terrain/store/open/stored_tiles.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using test::TempDir;

constexpr int kCols = 420, kRows = 330;
constexpr double kStep = 1.0 / 1200, kWest = -121.7, kNorth = 46.9;

/// A rough terrain with a round void in the south-east.
HeightGrid world() {
  HeightGrid grid = test::rough_terrain(kCols, kRows, 5);
  for (int r = 0; r < kRows; ++r)
    for (int c = 0; c < kCols; ++c)
      if (std::hypot(c - 340, r - 250) < 25) grid.at(c, r) = NAN;
  return grid;
}

class UpdateTest : public testing::Test {
 protected:
  /// Writes the DEM; always the same file.
  std::shared_ptr<const DemSource> dem(const HeightGrid& grid) const {
    const std::string path = folder_.file("dem.asc");
    {
      std::ofstream out(path);
      out << "ncols " << kCols << "\nnrows " << kRows << "\nxllcenter " << kWest << "\nyllcenter "
          << kNorth - (kRows - 1) * kStep << "\ncellsize " << kStep << "\nNODATA_value -9999\n";
      out.precision(9);
      for (int r = 0; r < kRows; ++r)
        for (int c = 0; c < kCols; ++c)
          out << (grid.is_void(c, r) ? -9999.f : grid.at(c, r)) << (c + 1 < kCols ? ' ' : '\n');
    }
    std::ofstream(folder_.file("dem.prj"))
        << R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,)"
        << R"(298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
    auto source = DemSource::open(std::vector{path});
    if (!source) throw std::runtime_error(source.error().what);
    return *source;
  }
  BuildOptions options(const std::string& name) const {
    BuildOptions o;
    o.output = folder_.file(name);
    o.tiles.max_error_m = 10;
    o.tiles.effort = Effort::fast;
    return o;
  }
  BuildReport build(const HeightGrid& grid, const std::string& name) const {
    const auto report = build_tiles(dem(grid), options(name));
    EXPECT_TRUE(report) << report.error().what;
    return report.value_or(BuildReport{});
  }
  /// Every file and what is in it.
  /// While a build goes on, its own files may go between being seen and being read.
  std::map<std::string, std::string> files(const std::string& name) const {
    std::map<std::string, std::string> all;
    std::error_code gone;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path() / name)) {
      if (!entry.is_regular_file(gone)) continue;
      std::ifstream in(entry.path(), std::ios::binary);
      if (!in) continue;
      all[entry.path().lexically_relative(folder_.path() / name).string()] = {
          std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    }
    return all;
  }
  /// By tile, which file it is: another one after it was written again.
  std::map<TileId, ino_t> tiles(const std::string& name) const {
    std::map<TileId, ino_t> all;
    for (const auto& [path, bytes] : files(name)) {
      int z = 0, x = 0, y = 0;
      if (std::sscanf(path.c_str(), "%d/%d/%d.terrain", &z, &x, &y) != 3) continue;
      struct stat info {};
      EXPECT_EQ(stat((folder_.path() / name / path).c_str(), &info), 0);
      all[*tiling::tile(z, x, y)] = info.st_ino;
    }
    return all;
  }
  static std::set<TileId> rewritten(const std::map<TileId, ino_t>& before,
                                    const std::map<TileId, ino_t>& after) {
    std::set<TileId> ids;
    for (const auto& [id, inode] : after)
      if (before.at(id) != inode) ids.insert(id);
    return ids;
  }
  /// Keeps the files of the old tiles, so that no new one can get the same inode.
  void hold(const std::string& name) const {
    fs::copy(folder_.path() / name, folder_.path() / (name + "-held"),
             fs::copy_options::recursive | fs::copy_options::create_hard_links);
  }
  void expect_like_fresh(const HeightGrid& grid, const std::string& name) const {
    build(grid, name + "-fresh");
    EXPECT_EQ(files(name), files(name + "-fresh"));
  }

  TempDir folder_;
};

/// Tiles of a level that hold one of the posts, and their eight neighbours.
struct Touched {
  std::set<TileId> holding, around;
};
Touched touched(int level, int c0, int r0, int c1, int r1) {
  Touched t;
  const double side = tiling::tile_degrees(level);
  for (int r = r0; r <= r1; ++r)
    for (int c = c0; c <= c1; ++c) {
      const auto x = std::int64_t(std::floor((kWest + c * kStep + 180) / side));
      const auto y = std::int64_t(std::floor((kNorth - r * kStep + 90) / side));
      t.holding.insert(*tiling::tile(level, x, y));
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          if (const auto id = tiling::tile(level, x + dx, y + dy)) t.around.insert(*id);
    }
  return t;
}

TEST_F(UpdateTest, what_changed_inside_is_made_again_with_its_neighbours_and_ancestors_only) {
  HeightGrid grid = world();
  const auto first = build(grid, "tiles");
  EXPECT_FALSE(first.update.updated);
  hold("tiles");
  const auto before = tiles("tiles");
  for (int r = 140; r < 150; ++r)
    for (int c = 190; c < 200; ++c) grid.at(c, r) += 40;
  const auto report = build(grid, "tiles");
  const std::set<TileId> made = rewritten(before, tiles("tiles"));
  EXPECT_TRUE(report.update.updated);
  EXPECT_EQ(report.update.block_posts, 16);
  EXPECT_EQ(report.update.blocks, 27u * 21u);
  EXPECT_EQ(report.update.changed_blocks, 4u);  // columns 190..199, rows 140..149 in 16s
  EXPECT_EQ(report.update.dirty_tiles, made.size());
  EXPECT_EQ(report.built, made.size());
  EXPECT_EQ(report.reused, before.size() - made.size());
  EXPECT_EQ(report.tiles, before.size());
  const int leaves = report.levels.back().level;
  for (int z = 0; z <= leaves; ++z) {
    const Touched t = touched(z, 190, 140, 199, 149);
    for (const TileId id : t.holding) EXPECT_TRUE(made.contains(id)) << id.text();
    for (const TileId id : made) EXPECT_TRUE(id.level != z || t.around.contains(id)) << id.text();
  }
  EXPECT_LT(made.size(), before.size() / 2);
  expect_like_fresh(grid, "tiles");
}

TEST_F(UpdateTest, a_corner_and_a_void_change_what_is_filled_around_them) {
  HeightGrid grid = world();
  build(grid, "tiles");
  grid.at(0, kRows - 1) += 30;   // what lies outside the data follows it
  grid.at(340 + 26, 250) += 25;  // so does the void
  grid.at(100, 100) = NAN;       // a new one
  const auto report = build(grid, "tiles");
  EXPECT_EQ(report.update.changed_blocks, 3u);
  EXPECT_EQ(report.built, report.update.dirty_tiles);
  EXPECT_GT(report.reused, 0u);
  expect_like_fresh(grid, "tiles");
}

TEST_F(UpdateTest, of_tiles_that_rest_on_a_residual_index) {
  HeightGrid grid = world();
  BuildOptions o = options("tiles");
  o.tiles.max_error_m = 40;
  o.tiles.exact_posts = 1 << 13;
  const auto first = build_tiles(dem(grid), o);
  ASSERT_TRUE(first) << first.error().what;
  ASSERT_GE(first->indexed_level, 8);
  for (int r = 140; r < 150; ++r)
    for (int c = 190; c < 200; ++c) grid.at(c, r) += 40;
  grid.at(0, kRows - 1) += 30;
  grid.at(340 + 26, 250) += 25;  // beside the void
  const auto report = build_tiles(dem(grid), o);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_TRUE(report->index_made);
  EXPECT_GT(report->reused, 0u);
  EXPECT_EQ(report->built, report->update.dirty_tiles);
  o.output = folder_.file("fresh");
  ASSERT_TRUE(build_tiles(dem(grid), o));
  const auto updated = files("tiles"), fresh = files("fresh");
  EXPECT_EQ(updated.size(), fresh.size());
  for (const auto& [path, bytes] : fresh)  // the index knows which file it was made of
    EXPECT_TRUE(path == "residuals.tind" || updated.at(path) == bytes) << path;
}

TEST_F(UpdateTest, the_same_heights_in_a_new_file_change_nothing) {
  build(world(), "tiles");
  const auto before = files("tiles");
  const auto report = build(world(), "tiles");
  EXPECT_FALSE(report.update.updated);
  EXPECT_EQ(report.built, 0u);
  EXPECT_EQ(files("tiles"), before);
}

TEST_F(UpdateTest, a_spike_changes_the_steps_of_the_tiles_around_it_only) {
  HeightGrid grid = world();
  BuildOptions o = options("tiles");
  o.tiles.max_error_m = 3;
  ASSERT_TRUE(build_tiles(dem(grid), o));
  grid.at(200, 160) = 8000;
  const auto report = build_tiles(dem(grid), o);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->update.levels_of_other_steps, 0);
  EXPECT_GT(report->reused, 0u);
  EXPECT_EQ(report->built, report->update.dirty_tiles);
  o.output = folder_.file("fresh");
  ASSERT_TRUE(build_tiles(dem(grid), o));
  EXPECT_EQ(files("tiles"), files("fresh"));
  grid.at(200, 160) = 100;  // and away again
  o.output = folder_.file("tiles");
  ASSERT_TRUE(build_tiles(dem(grid), o));
  o.output = folder_.file("anew");
  ASSERT_TRUE(build_tiles(dem(grid), o));
  EXPECT_EQ(files("tiles"), files("anew"));
}

/// Without what a build that runs has not finished yet.
std::map<std::string, std::string> served(std::map<std::string, std::string> files) {
  std::erase_if(files, [](const auto& file) {
    return file.first.starts_with("tind-update") || file.first.starts_with("tind-partial") ||
           file.first == "tind-lock";
  });
  return files;
}

TEST_F(UpdateTest, until_all_is_ready_the_old_tiles_are_there_and_a_killed_update_goes_on) {
  HeightGrid grid = world();
  build(grid, "tiles");
  const auto old = files("tiles");
  for (int r = 0; r < 30; ++r) grid.at(5 + r, r) += 15;
  std::stop_source stop;
  Progress progress;
  progress.stop = stop.get_token();
  progress.report = [&](double share) {
    EXPECT_EQ(share == 1, served(files("tiles")) != old) << share;
    if (share > 0.3) stop.request_stop();
  };
  const auto stopped = build_tiles(dem(grid), options("tiles"), progress);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::cancelled);
  EXPECT_EQ(served(files("tiles")), old);
  EXPECT_GT(files("tiles").size(), old.size());
  const auto resumed = build(grid, "tiles");
  EXPECT_TRUE(resumed.update.updated);
  EXPECT_GT(resumed.built, 0u);
  EXPECT_LT(resumed.built, resumed.update.dirty_tiles);
  expect_like_fresh(grid, "tiles");
}

TEST_F(UpdateTest, an_update_that_is_not_wanted_any_more_goes) {
  const HeightGrid grid = world();
  build(grid, "tiles");
  const auto old = files("tiles");
  HeightGrid other = grid;
  for (int r = 0; r < 30; ++r) other.at(5 + r, r) += 15;
  const auto begin_update = [&] {
    std::stop_source stop;
    Progress progress;
    progress.stop = stop.get_token();
    progress.report = [&](double share) {
      if (share > 0.3) stop.request_stop();
    };
    ASSERT_FALSE(build_tiles(dem(other), options("tiles"), progress));
    ASSERT_GT(files("tiles").size(), old.size());
  };
  begin_update();
  build(grid, "tiles");  // the source is as it was
  EXPECT_EQ(files("tiles"), old);
  begin_update();
  other.at(100, 100) += 50;  // to yet another content: tiles of the first one are of no use
  ASSERT_TRUE(build(other, "tiles").update.updated);
  expect_like_fresh(other, "tiles");
}

TEST_F(UpdateTest, killed_while_it_moves_it_ends_the_same) {
  HeightGrid grid = world();
  build(grid, "old");
  for (int r = 0; r < 30; ++r) grid.at(5 + r, r) += 15;
  build(grid, "new");
  const auto old = files("old"), wanted = files("new");
  std::vector<std::string> moved;  // what the update has, the record last
  for (const auto& [path, bytes] : wanted)
    if (const auto before = old.find(path); before == old.end() || before->second != bytes)
      moved.push_back(path);
  std::ranges::sort(moved, {}, [](const std::string& p) { return p == "tind-build.json"; });
  ASSERT_GT(moved.size(), 6u);
  for (const std::size_t n : {std::size_t(0), moved.size() / 2, moved.size() - 1, moved.size()}) {
    fs::remove_all(folder_.path() / "tiles");
    fs::copy(folder_.path() / "old", folder_.path() / "tiles", fs::copy_options::recursive);
    for (std::size_t i = 0; i < moved.size(); ++i) {
      const fs::path ready = folder_.path() / "tiles" / "tind-update-ready";
      const fs::path to = (i < n ? folder_.path() / "tiles" : ready) / moved[i];
      fs::create_directories(ready);
      fs::create_directories(to.parent_path());
      fs::copy_file(folder_.path() / "new" / moved[i], to, fs::copy_options::overwrite_existing);
    }
    // What counts is served from where it is.
    const auto served = open_stored_tiles((folder_.path() / "tiles").string());
    ASSERT_TRUE(served) << served.error().what;
    const auto fresh = open_stored_tiles((folder_.path() / "new").string());
    ASSERT_TRUE(fresh) << fresh.error().what;
    EXPECT_EQ((*served)->layer().version, (*fresh)->layer().version) << n;
    for (const auto& [path, bytes] : wanted) {
      int z = 0, x = 0, y = 0;
      if (std::sscanf(path.c_str(), "%d/%d/%d.terrain", &z, &x, &y) != 3) continue;
      const auto tile = (*served)->tile(*tiling::tile(z, x, y), {});
      ASSERT_TRUE(tile) << n << " " << tile.error().what;
      EXPECT_EQ(std::string(tile->bytes.begin(), tile->bytes.end()), bytes) << n << " " << path;
    }
    // And so is what it was made of: a copy is of the update alone, and nobody mends it by the old.
    const std::string copy = folder_.file("copy");
    fs::remove_all(copy);
    const auto copied = copy_store(*open_store((folder_.path() / "tiles").string()), copy, {});
    ASSERT_TRUE(copied) << copied.error().what;
    EXPECT_EQ(files("copy"), wanted) << n;
    const auto mended = repair_tiles(dem(world()), folder_.file("tiles"), 1);
    ASSERT_FALSE(mended) << n;
    EXPECT_THAT(mended.error().what, testing::HasSubstr("the heights are others by now")) << n;
    const auto report = build(grid, "tiles");
    EXPECT_EQ(report.built, 0u) << n;
    EXPECT_EQ(files("tiles"), wanted) << n;
  }
}

TEST_F(UpdateTest, without_the_old_blocks_it_is_refused_and_says_why) {
  HeightGrid grid = world();
  build(grid, "tiles");
  for (const auto& entry : fs::directory_iterator(folder_.path() / "tiles"))
    if (entry.path().filename().string().starts_with("tind-blocks-"))
      std::ofstream(entry.path()) << "TNSB";
  grid.at(7, 7) += 1;
  const auto report = build_tiles(dem(grid), options("tiles"));
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, Errc::invalid_argument);
  EXPECT_THAT(report.error().what, testing::HasSubstr("what changed cannot be told"));
  BuildOptions force = options("tiles");
  force.force = true;
  ASSERT_TRUE(build_tiles(dem(grid), force));
  expect_like_fresh(grid, "tiles");
}

TEST(SourceBlocks, any_other_bytes_are_refused) {
  DemInfo info;
  info.cols = 70, info.rows = 40;
  SourceBlocks blocks(info);
  HeightGrid grid = test::rough_terrain(70, 40, 3);
  grid.at(69, 39) = NAN;
  blocks.add(0, 0, grid);
  EXPECT_EQ(blocks.size(), 15u);
  EXPECT_TRUE(blocks.has_void(4, 2));
  EXPECT_FALSE(blocks.has_void(1, 1));
  const std::string bytes = blocks.encode();
  const auto same = SourceBlocks::decode(bytes, info, blocks.digest());
  ASSERT_TRUE(same);
  EXPECT_EQ(same->encode(), bytes);
  for (std::int64_t j = 0; j < blocks.down(); ++j)
    for (std::int64_t i = 0; i < blocks.across(); ++i)
      EXPECT_FALSE(blocks.differs(i, j, *same)) << i << " " << j;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    EXPECT_FALSE(SourceBlocks::decode(bytes.substr(0, i), info, blocks.digest())) << i;
    std::string damaged = bytes;
    damaged[i] ^= 4;
    EXPECT_FALSE(SourceBlocks::decode(damaged, info, blocks.digest())) << i;
  }
  EXPECT_FALSE(SourceBlocks::decode(bytes + '\0', info, blocks.digest()));
}

TEST(SourceBlocks, of_a_grid_that_went_on_differ_where_there_is_a_height) {
  DemInfo info;
  info.cols = 40, info.rows = 20;
  SourceBlocks small(info);
  small.add(0, 0, test::rough_terrain(40, 20, 3));
  info.cols = 80, info.rows = 36;
  SourceBlocks large(info);
  HeightGrid grid(80, 36);  // of voids
  const HeightGrid old = test::rough_terrain(40, 20, 3);
  for (int r = 0; r < 20; ++r)
    for (int c = 0; c < 40; ++c) grid.at(c, r) = old.at(c, r);
  grid.at(70, 5) = 1;
  large.add(0, 0, grid);
  EXPECT_TRUE(large.all_void(3, 0));
  EXPECT_TRUE(large.all_void(1, 2));
  EXPECT_TRUE(large.all_void(9, 9));
  EXPECT_FALSE(large.all_void(4, 0));
  EXPECT_FALSE(small.all_void(0, 0));
  EXPECT_FALSE(large.differs(0, 0, small));
  EXPECT_TRUE(large.differs(2, 0, small));   // the small one ends in it
  EXPECT_FALSE(large.differs(3, 0, small));  // nothing, and beyond it
  EXPECT_TRUE(large.differs(4, 0, small));
  EXPECT_TRUE(small.differs(4, 0, large));
  EXPECT_FALSE(small.differs(3, 2, large));
}

}  // namespace
}  // namespace tind
