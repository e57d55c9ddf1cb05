// Updates of folders whose surface has other files or other layers than it had: nobody can tell
// afterwards, and what lies far from the change is not made again.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "terrain/base/file_io.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/store/folder/folder_files.h"
#include "terrain/store/folder/folder_writer.h"
#include "terrain/surface/surface.h"
#include "tests/support/layered_world.h"
#include "tests/support/support.h"
#include "tests/support/watched_files.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using test::TempDir;

/// One file of a layer: a part of the layer's grid, with heights that a number stands for.
struct Piece {
  int col = 0, row = 0, cols = 0, rows = 0;  // of the grid; may be west and north of its corner
  int version = 1;
  bool there = true;
};

struct Part {
  std::string name, crs;
  double x, y, step;  // of the grid's post (0, 0), in the units of its CRS
  float relief;
  std::vector<Piece> pieces;
  double blend_m = -1;
  bool there = true;

  bool any() const {
    return there && std::ranges::any_of(pieces, [](const Piece& p) { return p.there; });
  }
};

/// A country of a projected grid and a town over a world of longitudes and latitudes, each of six
/// files, whose sides have `times` as many posts.
std::vector<Part> world(int times = 1) {
  const auto quarters = [&](int cols, int rows) {
    std::vector<Piece> pieces;
    cols *= times, rows *= times;
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 3; ++i) pieces.push_back({i * cols, j * rows, cols, rows});
    return pieces;
  };
  return {{"world", "EPSG:4326", 8.0, 47.0, 0.03125, 1500, quarters(24, 22)},
          {"country", "EPSG:32632", 480000, 5150000, 500, 700, quarters(32, 30)},
          {"town", "EPSG:4326", 9.0, 46.4, 1 / 1024., 200, quarters(30, 28)}};
}

class LayeredUpdateTest : public testing::Test {
 protected:
  /// Always the same file for the same piece.
  std::string file_of(const Part& part, const Piece& p) const {
    const std::string path = folder_.file(
        fmt::format("{}-{}-{}-{}.asc", part.name, p.col + 100, p.row + 100, p.version));
    if (fs::exists(path)) return path;
    const unsigned seed = unsigned(p.col * 131 + p.row * 17 + p.version * 7 + int(part.relief));
    HeightGrid grid = test::rough_terrain(p.cols, p.rows, seed, part.relief);
    for (int r = 0; r < p.rows; ++r)  // a lake of voids in some
      for (int c = 0; c < p.cols; ++c)
        if (seed % 3 == 0 && std::hypot(c - p.cols / 2, r - p.rows / 3) < 4)
          grid.at(c, r) = HeightGrid::kVoid;
    std::ofstream out(path);
    out << fmt::format(
        "ncols {}\nnrows {}\nxllcenter {}\nyllcenter {}\ncellsize {}\nNODATA_value -9999\n", p.cols,
        p.rows, part.x + p.col * part.step, part.y - (p.row + p.rows - 1) * part.step, part.step);
    for (int r = 0; r < p.rows; ++r)
      for (int c = 0; c < p.cols; ++c)
        out << (grid.is_void(c, r) ? -9999.f : std::round(grid.at(c, r)))
            << (c + 1 < p.cols ? ' ' : '\n');
    return path;
  }

  Result<Surface> surface(const std::vector<Part>& parts) const {
    std::vector<SurfaceLayer> layers;
    for (const Part& part : parts) {
      std::vector<std::string> files;
      for (const Piece& p : part.pieces)
        if (p.there) files.push_back(file_of(part, p));
      if (!part.any()) continue;
      DemOptions o;
      o.crs = part.crs;
      auto source = DemSource::open(files, o);
      if (!source) return std::unexpected(source.error());
      layers.push_back({.name = part.name, .source = *source, .blend_m = part.blend_m});
    }
    return Surface::of_layers(std::move(layers));
  }

  Result<BuildReport> build(const std::vector<Part>& parts, const std::string& name,
                            bool force = false) const {
    auto made_of = surface(parts);
    if (!made_of) return std::unexpected(made_of.error());
    BuildOptions o;
    o.output = folder_.file(name);
    o.tiles.effort = Effort::fast;
    o.tiles.max_error_m = 25;
    o.tiles.exact_posts = exact_posts_;
    o.threads = 2;
    o.force = force;
    return build_tiles(*made_of, o);
  }

  /// Folders, too: an update leaves none that is empty. Not the residual index, whose records lie
  /// in any order.
  std::map<std::string, std::string> files(const std::string& name) const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path() / name))
      if (entry.path().filename() != "residuals.tind")
        all[entry.path().lexically_relative(folder_.path() / name).string()] =
            entry.is_regular_file() ? *read_whole_file(entry.path().string()) : "folder";
    return all;
  }

  /// As names, so that a failure can be read.
  void expect_like_fresh(const std::vector<Part>& parts, const std::string& name) const {
    fs::remove_all(folder_.path() / "fresh");
    const auto fresh = build(parts, "fresh");
    ASSERT_TRUE(fresh) << fresh.error().what;
    const auto updated = files(name), wanted = files("fresh");
    std::vector<std::string> wrong;
    for (const auto& [path, bytes] : wanted)
      if (const auto it = updated.find(path); it == updated.end() || it->second != bytes)
        wrong.push_back((it == updated.end() ? "missing " : "other ") + path);
    for (const auto& [path, bytes] : updated)
      if (!wanted.contains(path)) wrong.push_back("too many " + path);
    EXPECT_THAT(wrong, testing::IsEmpty());
  }

  TempDir folder_;
  std::int64_t exact_posts_ = 0;  // of tiles that rest on no residual index
};

/// What somebody does to a catalog of files.
std::string change(std::vector<Part>& parts, std::mt19937& random) {
  const auto below = [&](std::size_t n) { return std::size_t(random() % n); };
  Part& part = parts[below(parts.size())];
  Piece& piece = part.pieces[below(part.pieces.size())];
  const std::string which = fmt::format("{} {},{}", part.name, piece.col, piece.row);
  switch (below(10)) {
    case 0:
      part.there = !part.there;
      return part.name + (part.there ? " comes" : " goes");
    case 1:
      part.blend_m = part.blend_m < 0 ? 3000 : -1;
      return part.name + " has another blend";
    case 2:
    case 3:
    case 4:
      piece.version++;
      return which + " is replaced";
    default:
      piece.there = !piece.there;
      return which + (piece.there ? " comes" : " goes");
  }
}

class LayeredUpdates : public LayeredUpdateTest, public testing::WithParamInterface<unsigned> {};

TEST_P(LayeredUpdates, end_as_a_fresh_build_whatever_comes_and_goes) {
  std::mt19937 random(GetParam());
  std::vector<Part> parts = world();
  for (Part& part : parts)
    for (Piece& p : part.pieces) p.there = random() % 2 == 0;
  parts[0].pieces[0].there = true;
  ASSERT_TRUE(build(parts, "tiles"));
  std::uint64_t kept = 0;
  for (int step = 0; step < 6; ++step) {
    std::vector<Part> next = parts;
    std::string what = change(next, random);
    if (random() % 3 == 0) what += ", " + change(next, random);
    SCOPED_TRACE(fmt::format("step {}: {}", step, what));
    if (std::ranges::none_of(next, &Part::any)) continue;
    auto report = build(next, "tiles");
    if (!report) {  // nothing in common with what is there
      EXPECT_EQ(report.error().code, Errc::invalid_argument) << report.error().what;
      report = build(next, "tiles", true);
    }
    ASSERT_TRUE(report) << report.error().what;
    kept += report->reused;
    expect_like_fresh(next, "tiles");
    if (HasFailure()) return;
    parts = next;
  }
  EXPECT_GT(kept, 0u);
}

/// The same of coarse tiles that rest on the residual index.
class IndexedLayeredUpdateTest : public LayeredUpdateTest {
 protected:
  IndexedLayeredUpdateTest() { exact_posts_ = 1 << 13; }

  void expect_updated(const std::vector<Part>& parts, const char* what,
                      std::uint64_t least_reused = 0) const {
    SCOPED_TRACE(what);
    const auto report = build(parts, "tiles");
    ASSERT_TRUE(report) << report.error().what;
    EXPECT_TRUE(report->update.updated);
    EXPECT_EQ(report->update.everything, "");
    EXPECT_GE(report->indexed_level, 6);
    EXPECT_GE(report->reused, least_reused);
    expect_like_fresh(parts, "tiles");
  }
};

TEST_F(IndexedLayeredUpdateTest, ends_as_a_fresh_build) {
  std::vector<Part> parts = world();
  const Piece last = parts[2].pieces.back();
  parts[2].pieces.pop_back();
  ASSERT_TRUE(build(parts, "tiles"));
  parts[2].pieces.push_back(last);
  expect_updated(parts, "a file of the town comes");
  parts[2].there = false;
  expect_updated(parts, "the town goes");
  parts[2].there = true;
  expect_updated(parts, "the town comes again");
}

TEST_F(IndexedLayeredUpdateTest, over_the_antimeridian_too) {
  std::vector<Part> parts = world();
  parts[0].x = 179, parts[1].x = 700000, parts[2].x = 179.97;
  parts[1].crs = "EPSG:32660";
  const auto first = build(parts, "tiles");
  ASSERT_TRUE(first) << first.error().what;
  EXPECT_GE(first->indexed_level, 6);
  EXPECT_EQ(first->over_budget, 0u);
  test::expect_no_violation(folder_.file("tiles"), *surface(parts));
  parts[1].pieces[0].version = 9;
  expect_updated(parts, "a file of the country is replaced");
}

TEST_F(IndexedLayeredUpdateTest, makes_again_what_a_file_reaches_and_no_more) {
  exact_posts_ = 1 << 16;
  std::vector<Part> parts = world(4);
  const auto first = build(parts, "tiles");
  ASSERT_TRUE(first) << first.error().what;
  parts[2].pieces[5].there = false;
  expect_updated(parts, "a file of the town goes", first->tiles / 8);
}

/// A town makes its surroundings rest on the index: tiles beside those, which it does not reach,
/// have other normals along the edge that they share.
TEST_F(IndexedLayeredUpdateTest, a_second_town_far_from_the_first_changes_its_neighbours_too) {
  exact_posts_ = 1 << 16;
  const auto town = [](const char* name, double lon, double lat) {
    return Part{name, "EPSG:4326", lon, lat, 0.0005, 200, {{0, 0, 300, 300}}};
  };
  std::vector<Part> parts = {{"land", "EPSG:4326", -2, 56, 0.125, 1500, {{0, 0, 193, 145}}},
                             town("first", 2.8, 42.15)};
  ASSERT_TRUE(build(parts, "tiles"));
  parts.push_back(town("second", 14, 50.65));
  const auto report = build(parts, "tiles");
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->update.everything, "");
  expect_like_fresh(parts, "tiles");
}

/// What is far from a change stays.
TEST_F(LayeredUpdateTest, a_file_that_comes_or_goes_makes_again_what_it_reaches_and_no_more) {
  std::vector<Part> parts = world(4);
  const Piece south_east = parts[1].pieces.back();
  parts[1].pieces.pop_back();
  const auto first = build(parts, "tiles");
  ASSERT_TRUE(first) << first.error().what;
  std::uint64_t there = first->tiles;
  const auto expect_bounded = [&](const char* what) {
    SCOPED_TRACE(what);
    const auto report = build(parts, "tiles");
    ASSERT_TRUE(report) << report.error().what;
    EXPECT_TRUE(report->update.updated);
    EXPECT_EQ(report->update.everything, "");
    EXPECT_EQ(report->built, report->update.dirty_tiles);
    EXPECT_GT(report->built, 0u);
    EXPECT_GT(report->reused, there / 8);
    there = report->tiles;
    expect_like_fresh(parts, "tiles");
  };
  parts[1].pieces.push_back(south_east);
  expect_bounded("a file of the country comes");
  parts[2].pieces[5].there = false;
  expect_bounded("a file of the town goes");
  parts[2].there = false;
  expect_bounded("the town goes");
  parts[2].there = true;
  expect_bounded("the town comes again");
  parts[0].pieces[5].version = 9;
  expect_bounded("a file of the world is replaced");
}

TEST_F(LayeredUpdateTest, another_blend_is_called_that) {
  std::vector<Part> parts = world(4);
  ASSERT_TRUE(build(parts, "tiles"));
  parts[2].blend_m = 3000;
  const auto report = build(parts, "tiles");
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->update.bent_layers, std::vector<std::string>{parts[2].name});
  EXPECT_TRUE(report->update.new_layers.empty());
  EXPECT_EQ(report->update.gone_layers, 0u);
  parts[2].there = false;
  const auto gone = build(parts, "tiles");
  ASSERT_TRUE(gone) << gone.error().what;
  EXPECT_TRUE(gone->update.bent_layers.empty());
  EXPECT_EQ(gone->update.gone_layers, 1u);
}

TEST_F(LayeredUpdateTest, of_one_layer_of_several_files_the_same) {
  std::vector<Part> parts = {world(4)[2]};
  parts[0].pieces.back().there = false;
  ASSERT_TRUE(build(parts, "tiles"));
  parts[0].pieces.back().there = true;
  const auto report = build(parts, "tiles");
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->update.everything, "");
  EXPECT_GT(report->reused, report->tiles / 4);
  expect_like_fresh(parts, "tiles");
}

TEST_F(LayeredUpdateTest, everything_is_made_again_where_layers_come_to_one_dem_and_it_says_so) {
  std::vector<Part> parts = world();
  parts[1].there = parts[2].there = false;
  ASSERT_TRUE(build(parts, "tiles"));
  parts[2].there = true;
  const auto report = build(parts, "tiles");
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_NE(report->update.everything, "");
  EXPECT_EQ(report->built, report->tiles);
  expect_like_fresh(parts, "tiles");
}

TEST_F(LayeredUpdateTest, layers_that_have_nothing_in_common_are_another_source) {
  std::vector<Part> parts = world();
  parts[1].there = parts[2].there = false;
  ASSERT_TRUE(build(parts, "tiles"));
  const auto before = files("tiles");
  parts[0].there = false, parts[1].there = parts[2].there = true;
  const auto report = build(parts, "tiles");
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, Errc::invalid_argument);
  EXPECT_EQ(files("tiles"), before);
  BuildOptions o;
  o.output = folder_.file("tiles");
  o.tiles.effort = Effort::fast;
  o.tiles.max_error_m = 25;
  EXPECT_FALSE(foresee_update(*surface(parts), o));
  parts[0].there = true;
  const auto foreseen = foresee_update(*surface(parts), o);
  ASSERT_TRUE(foreseen) << foreseen.error().what;
  EXPECT_EQ(files("tiles"), before);
  const auto update = build(parts, "tiles");
  ASSERT_TRUE(update) << update.error().what;
  EXPECT_EQ(update->update.dirty_tiles, foreseen->dirty_tiles);
}

TEST_F(LayeredUpdateTest, a_power_cut_leaves_the_old_tiles_or_the_new_ones) {
  std::vector<Part> parts = world();
  for (Part& part : parts) part.pieces.resize(2);
  const auto options = [&](const std::string& name, std::shared_ptr<FolderFiles> files) {
    BuildOptions o;
    o.output = folder_.file(name);
    o.tiles.effort = Effort::fast;
    o.tiles.max_error_m = 25;
    o.threads = 2;
    o.batch = 8;
    o.lock = [files](const std::string& output) { return lock_folder(output, files); };
    return o;
  };
  const auto plain = std::make_shared<test::Unsynced>();
  ASSERT_TRUE(build_tiles(*surface(parts), options("disk/tiles", plain)));
  parts[0].pieces.push_back({24, 22, 24, 22});
  parts[2].there = false;
  const Surface wanted_of = *surface(parts);
  ASSERT_TRUE(build_tiles(wanted_of, options("wanted", plain)));
  const auto without_folders = [](std::map<std::string, std::string> all) {
    std::erase_if(all, [](const auto& file) { return file.second == "folder"; });
    return all;
  };
  const auto wanted = without_folders(files("wanted"));
  const auto watched = std::make_shared<test::WatchedFiles>(folder_.file("disk"));
  const auto update = build_tiles(wanted_of, options("disk/tiles", watched));
  ASSERT_TRUE(update) << update.error().what;
  EXPECT_GT(update->update.gone_tiles, 0u);
  EXPECT_EQ(without_folders(files("disk/tiles")), wanted);
  std::mt19937 random(3);
  for (int cut = 0; cut < 40; ++cut) {
    const std::string name = fmt::format("cut{}", cut);
    watched->leave(random() % (watched->steps() + 1), random, folder_.file(name));
    std::ofstream(folder_.file(name + "/tiles/tind-lock"))
        << "tind build: process 1 on elsewhere since 2020-01-01T00:00:00Z\n";
    const auto again = build_tiles(wanted_of, options(name + "/tiles", plain));
    ASSERT_TRUE(again) << cut << ": " << again.error().what;
    EXPECT_EQ(without_folders(files(name + "/tiles")), wanted) << cut;
    fs::remove_all(folder_.path() / name);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, LayeredUpdates, testing::Range(1u, 5u));

}  // namespace
}  // namespace tind
