// Sources of files that lie apart: there are tiles where there are files, and nowhere else.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "terrain/check/check.h"
#include "terrain/geo/tile_order.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/build/estimate.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/pyramid/plan/plan_source.h"
#include "tests/support/counted_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

/// Files of 0.1 degrees a side, 21 x 21 posts.
class SparseTiles : public testing::Test {
 protected:
  std::string file(const std::string& name, double west, double south, bool valid = true) {
    const std::string path = dir_.file(name);
    std::ofstream(path + ".prj") << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",)"
                                    R"(6378137,298.257223563]],PRIMEM["Greenwich",0],)"
                                    R"(UNIT["degree",0.0174532925199433]])";
    std::ofstream out(path + ".asc");
    out << "ncols 21\nnrows 21\nxllcenter " << west << "\nyllcenter " << south
        << "\ncellsize 0.005\nNODATA_value -9999\n";
    for (int k = 0; k < 21 * 21; ++k)
      out << (valid ? 900 + k * 37 % 101 : -9999) << (k % 21 == 20 ? '\n' : ' ');
    return path + ".asc";
  }
  static std::shared_ptr<const DemSource> open(const std::vector<std::string>& files) {
    auto source = DemSource::open(files);
    EXPECT_TRUE(source) << source.error().what;
    return source ? *source : nullptr;
  }
  /// Builds into a folder of this name; everything that the checker finds fails the test.
  BuildReport build(const std::shared_ptr<const DemSource>& source, const std::string& name) {
    BuildOptions o;
    o.tiles.effort = Effort::fast;
    o.output = dir_.file(name);
    const auto report = build_tiles(source, o);
    EXPECT_TRUE(report) << report.error().what;
    CheckOptions check;
    check.source = source;
    const auto checked = check_tiles(o.output, check);
    EXPECT_TRUE(checked);
    if (checked) {
      EXPECT_TRUE(checked->ok()) << name;
    }
    return report ? *report : BuildReport{};
  }
  /// Tiles of a level without a post.
  int empty_tiles(const std::string& name, int level) {
    int empty = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(
             dir_.file(name + "/" + std::to_string(level)))) {
      if (!entry.is_regular_file()) continue;
      std::ifstream in(entry.path(), std::ios::binary);
      const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
      empty += bytes.find("\"posts\":0") != std::string::npos;
    }
    return empty;
  }

  test::TempDir dir_;
};

TEST_F(SparseTiles, stand_where_files_are) {
  const auto source = open({file("a", 10, 50), file("b", 15, 50), file("c", 12, 53)});
  ASSERT_TRUE(source);
  const auto plan = plan_source(*source, {}, "");
  ASSERT_TRUE(plan);
  const int deepest = plan->max_level();
  EXPECT_LE(plan->tiles(deepest).size(), 3 * 4u);
  EXPECT_GE(plan->tiles(deepest).ranges().size(), 3u);
  // Every tile has its parent, and the order has each once.
  const TileOrder order = plan->order();
  std::set<TileId> ids;
  for (std::size_t i = 0; i < order.size(); ++i) {
    EXPECT_TRUE(plan->available(order[i]));
    if (order[i].level > 0) {
      EXPECT_TRUE(plan->available(order[i].parent())) << order[i].text();
    }
    ids.insert(order[i]);
  }
  EXPECT_EQ(ids.size(), plan->tile_count());
  // Layer, daemon, estimate and build agree.
  const auto tiles = open_dem_tiles(source, {});
  ASSERT_TRUE(tiles);
  for (int z = 0; z <= std::min(deepest, 8); ++z)
    for (std::uint32_t x = 0; x < tiling::columns(z); ++x)
      for (std::uint32_t y = 0; y < tiling::rows(z); ++y) {
        EXPECT_EQ((*tiles)->available({z, x, y}), ids.contains({z, x, y}));
        EXPECT_EQ((*tiles)->layer().contains(z, x, y), ids.contains({z, x, y}));
      }
  BuildOptions o;
  o.tiles.effort = Effort::fast;
  EXPECT_EQ(estimate_build(*source, o)->tiles, plan->tile_count());
  EXPECT_EQ(build(source, "tiles").tiles, plan->tile_count());
  for (int z = 1; z <= deepest; ++z) EXPECT_EQ(empty_tiles("tiles", z), 0) << z;
  EXPECT_TRUE(std::filesystem::exists(dir_.file("tiles/tind-build.json")));
}

TEST_F(SparseTiles, of_three_children_the_fourth_is_stood_in_for) {
  // Around a corner of tiles: all but the north-east, and two that touch at the corner only.
  const double side = tiling::tile_degrees(9);
  const double lon = -180 + 543 * side, lat = -90 + 401 * side;
  const auto a = file("sw", lon - .145, lat - .145), b = file("se", lon + .045, lat - .145),
             c = file("nw", lon - .145, lat + .045), d = file("ne", lon + .045, lat + .045);
  build(open({a, b, c}), "three");
  build(open({a, d}), "two");
}

TEST_F(SparseTiles, of_files_that_touch_leave_none_out) {
  // Posts to 10.1, and from 10.105 on: the way across is ground, too.
  const auto source = open({file("a", 10, 50), file("b", 10.105, 50), file("c", 10, 50.105)});
  ASSERT_TRUE(source);
  TileSetOptions options;
  options.max_level = 16;  // tiles finer than the posts are apart
  const auto plan = plan_source(*source, options, "");
  ASSERT_TRUE(plan);
  const double side = tiling::tile_degrees(16);
  for (double lon = 10; lon < 10.205; lon += side / 3)
    EXPECT_TRUE(plan->available(
        {16, std::uint32_t((lon + 180) / side), std::uint32_t((50.05 + 90) / side)}))
        << lon;
  EXPECT_FALSE(plan->available(
      {16, std::uint32_t((10.15 + 180) / side), std::uint32_t((50.15 + 90) / side)}));
}

TEST_F(SparseTiles, across_the_antimeridian_are_on_both_sides_of_it_only) {
  const auto source = open({file("a", 179.95, 10)});
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().bounds.width(), 360);
  const auto report = build(source, "tiles");
  EXPECT_LE(report.levels.back().tiles, 2 * 3u);
  for (std::size_t z = 1; z < report.levels.size(); ++z)
    EXPECT_EQ(empty_tiles("tiles", int(z)), 0) << z;
}

TEST_F(SparseTiles, far_apart_are_worth_a_line) {
  const auto a = file("a", 10, 50), b = file("b", 10.105, 50), far = file("far", 70, -20);
  const auto warning_of = [&](const std::vector<std::string>& files, TileSetOptions options) {
    const auto source = open(files);
    return TilePlan::make(*source, HeightRange{}, options)->warning(*source);
  };
  EXPECT_EQ(warning_of({a, b}, {}), "");
  EXPECT_NE(warning_of({a, b, far}, {}).find("3 files lie far apart"), std::string::npos);
  TileSetOptions deep;
  deep.max_level = 18;
  EXPECT_NE(warning_of({a}, deep).find("for 441 posts"), std::string::npos);
}

TEST_F(SparseTiles, a_dem_without_a_valid_post_is_named) {
  const auto source = open({file("void", 10, 50, false)});
  ASSERT_TRUE(source);
  const auto plan = plan_source(*source, {}, "");
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().code, Errc::bad_data);
  EXPECT_NE(plan.error().what.find("void.asc has no valid height"), std::string::npos)
      << plan.error().what;
}

/// The columns and rows between the files are millions of posts, and none of them is there.
TEST_F(SparseTiles, what_lies_between_files_is_hardly_read) {
  const auto source = open({file("alps", 7, 46), file("andes", -70, -33)});
  ASSERT_TRUE(source);
  const auto counted = std::make_shared<test::CountedSource>(source);
  build(counted, "tiles");
  EXPECT_LT(counted->posts_read, 30'000'000);
}

}  // namespace
}  // namespace tind
