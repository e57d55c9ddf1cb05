// Tiles of DEMs that have longitudes of more than half the globe, but not all: a tile may hold
// posts of both their ends, which lie a turn apart.

#include <gtest/gtest.h>

#include <fstream>
#include <memory>
#include <ostream>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "terrain/check/check.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/surface/tile_posts.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::TempDir;

constexpr int kRows = 20;

struct WideDem {
  std::string name;
  double west, step;
  int cols;
};
void PrintTo(const WideDem& dem, std::ostream* out) { *out << dem.name; }

/// In a file, always the same one; the first columns are so much higher.
std::shared_ptr<const DemSource> source_of(const WideDem& dem, const TempDir& folder, float lift) {
  const HeightGrid grid = test::rough_terrain(dem.cols, kRows, 7);
  {
    std::ofstream out(folder.file("dem.asc"));
    out << "ncols " << dem.cols << "\nnrows " << kRows << "\nxllcenter " << dem.west
        << "\nyllcenter " << 40 - (kRows - 1) * dem.step << "\ncellsize " << dem.step << '\n';
    out.precision(9);
    for (int row = 0; row < kRows; ++row)
      for (int col = 0; col < dem.cols; ++col)
        out << grid.at(col, row) + (col < 4 ? lift : 0) << (col + 1 < dem.cols ? ' ' : '\n');
  }
  std::ofstream(folder.file("dem.prj"))
      << R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,)"
      << R"(298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
  auto source = DemSource::open(std::vector{folder.file("dem.asc")});
  if (!source) throw std::runtime_error(source.error().what);
  return *source;
}

BuildOptions options_of(const std::string& folder) {
  BuildOptions o;
  o.output = folder;
  o.tiles.effort = Effort::fast;
  o.tiles.max_error_m = 2000;
  return o;
}

std::set<std::string> violations(const std::string& folder,
                                 const std::shared_ptr<const DemSource>& source) {
  CheckOptions check;
  check.source = source;
  const auto checked = check_tiles(folder, check);
  if (!checked) return {checked.error().what};
  std::set<std::string> found;
  for (std::size_t rule = 0; rule < kCheckRuleCount; ++rule)
    if (kCheckRules[rule].severity == Severity::violation && checked->findings[rule].count > 0)
      found.insert(std::string(kCheckRules[rule].id) + ": " + checked->findings[rule].examples[0]);
  return found;
}

class WideTiles : public testing::TestWithParam<WideDem> {};

TEST_P(WideTiles, hold_all_posts_of_both_ends) {
  for (const float lift : {0.0F, 1500.0F}) {
    const TempDir folder;
    const auto source = source_of(GetParam(), folder, lift);
    ASSERT_TRUE(build_tiles(source, options_of(folder.file("tiles"))));
    EXPECT_EQ(violations(folder.file("tiles"), source), std::set<std::string>{}) << lift;
  }
}

TEST_P(WideTiles, are_made_again_where_one_end_changes) {
  const TempDir folder;
  ASSERT_TRUE(build_tiles(source_of(GetParam(), folder, 0), options_of(folder.file("tiles"))));
  const auto higher = source_of(GetParam(), folder, 1500);
  const auto update = build_tiles(higher, options_of(folder.file("tiles")));
  ASSERT_TRUE(update) << update.error().what;
  const auto fresh = build_tiles(higher, options_of(folder.file("fresh")));
  ASSERT_TRUE(fresh);
  EXPECT_EQ(update->tiles, fresh->tiles);
  EXPECT_EQ(update->bytes, fresh->bytes);
  EXPECT_EQ(violations(folder.file("tiles"), higher), std::set<std::string>{});
}

INSTANTIATE_TEST_SUITE_P(of_dems, WideTiles,
                         testing::Values(WideDem{"a_gap", -10.2, 4, 87},
                                         WideDem{"to_180", -160, 4, 86},
                                         WideDem{"without_a_few", 0, 3, 119}),
                         [](const auto& dem) { return dem.param.name; });

TEST(PostWindows, are_two_where_the_ends_of_a_dem_are_in_one_rectangle) {
  const TempDir folder;
  const auto gap = source_of({"gap", -10.2, 4, 87}, folder, 0);  // up to 333.8
  const auto two = post_windows(*gap, {-180, -90, 0, 90});
  ASSERT_EQ(two.size(), 2u);
  EXPECT_GT(two[0].cols, two[1].cols);
  EXPECT_EQ(two[0].lon_shift, -360);
  EXPECT_EQ(two[1].lon_shift, 0);
  EXPECT_EQ(two[1].col, 0);
  EXPECT_EQ(post_windows(*gap, {0, -90, 180, 90}).size(), 1u);
  EXPECT_EQ(post_windows(*gap, {-90, 0, -45, 45}).size(), 1u);
  EXPECT_TRUE(post_windows(*gap, {-90, 60, -45, 90}).empty());
  const auto narrow = source_of({"narrow", 170, 1, 30}, folder, 0);
  const auto one = post_windows(*narrow, {-180, -90, 0, 90});
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0].lon_shift, -360);
}

}  // namespace
}  // namespace tind
