#include "terrain/surface/void_fill.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "terrain/surface/height_field.h"
#include "tests/support/made_up_source.h"

namespace tind {
namespace {

using test::MadeUpSource;

/// Where the first post is, for one post a degree.
Geographic corner(const HeightGrid& grid) { return {0, double(grid.rows() - 1)}; }

HeightGrid with_voids(std::mt19937& random, int cols, int rows, double share_valid) {
  HeightGrid grid(cols, rows);
  std::uniform_real_distribution<double> unit(0, 1);
  for (float& z : grid.values())
    if (unit(random) < share_valid) z = float(1000 + 500 * unit(random));
  return grid;
}

/// The rule, straight from its words; of several nearest posts any may be the one.
void expect_by_rule(const HeightGrid& grid, std::int64_t col, std::int64_t row, double filled) {
  double nearest = HUGE_VAL;
  for (int r = 0; r < grid.rows(); ++r)
    for (int c = 0; c < grid.cols(); ++c)
      if (!grid.is_void(c, r)) nearest = std::min(nearest, std::hypot(c - col, r - row));
  if (nearest > VoidFill::kReach) {
    EXPECT_EQ(filled, 0) << col << " " << row;
    return;
  }
  const double share =
      std::min(1.0, (VoidFill::kReach - nearest) / (VoidFill::kReach - VoidFill::kFlat));
  bool found = false;
  for (int r = 0; r < grid.rows(); ++r)
    for (int c = 0; c < grid.cols(); ++c)
      if (!grid.is_void(c, r) && std::hypot(c - col, r - row) == nearest)
        found |= std::abs(grid.at(c, r) * share - filled) < 1e-9;
  EXPECT_TRUE(found) << col << " " << row << " " << filled << " nearest " << nearest;
}

TEST(VoidFill, is_the_nearest_post_and_slopes_to_zero) {
  std::mt19937 random(1);
  for (const double share : {0.5, 0.02, 0.0005, 0.0}) {
    const HeightGrid grid = with_voids(random, 90, 70, share);
    const MadeUpSource source(grid, corner(grid), 1);
    const auto fill = VoidFill::load(source, -80, -80, 250, 230);
    ASSERT_TRUE(fill);
    std::uniform_int_distribution<int> col(-80, 169), row(-80, 149);
    for (int k = 0; k < 500; ++k) {
      const int c = col(random), r = row(random);
      expect_by_rule(grid, c, r, fill->at(c, r));
    }
  }
}

TEST(VoidFill, does_not_depend_on_what_else_is_asked) {
  std::mt19937 random(2);
  const MadeUpSource source(with_voids(random, 80, 80, 0.01), {0, 79}, 1);
  const auto all = VoidFill::load(source, -70, -70, 220, 220);
  ASSERT_TRUE(all);
  std::uniform_int_distribution<int> place(-70, 148);
  for (int k = 0; k < 300; ++k) {
    const int c = place(random), r = place(random);
    const auto one = VoidFill::load(source, c, r, 2, 2);
    ASSERT_TRUE(one);
    EXPECT_EQ(one->at(c, r), all->at(c, r));
    EXPECT_EQ(one->at(c + 1, r + 1), all->at(c + 1, r + 1));
  }
}

TEST(VoidFill, a_whole_source_keeps_its_posts_and_has_no_voids) {
  std::mt19937 random(3);
  const HeightGrid grid = with_voids(random, 60, 50, 0.3);
  const MadeUpSource source(grid, corner(grid), 1);
  const auto filled = fill_voids(source, grid);
  ASSERT_TRUE(filled);
  float low = 1e9f, high = -1e9f;
  for (const float z : grid.values())
    if (!std::isnan(z)) low = std::min(low, z), high = std::max(high, z);
  for (int r = 0; r < 50; ++r) {
    for (int c = 0; c < 60; ++c) {
      EXPECT_TRUE(grid.is_void(c, r) || filled->at(c, r) == grid.at(c, r));
      EXPECT_GE(filled->at(c, r), low);
      EXPECT_LE(filled->at(c, r), high);
    }
  }
}

TEST(VoidFill, between_two_nearest_posts_is_a_slope) {
  HeightGrid grid(40, 12);  // a valley of 8 void columns between 0 and 800
  for (int r = 0; r < 12; ++r)
    for (int c = 0; c < 40; ++c)
      if (c < 16 || c >= 24) grid.at(c, r) = c < 16 ? 0.f : 800.f;
  const MadeUpSource source(grid, corner(grid), 1);
  const auto filled = fill_voids(source, grid);
  ASSERT_TRUE(filled);
  for (int c = 15; c < 24; ++c)
    EXPECT_NEAR(filled->at(c + 1, 5) - filled->at(c, 5), 800. / 9, 5) << c;
}

TEST(HeightField, filled_is_continuous_across_voids_and_the_end_of_the_data) {
  std::mt19937 random(3);
  const MadeUpSource source(with_voids(random, 60, 60, 0.4), {0, 59}, 1);
  const HeightField field(source);
  constexpr double kStep = 1e-4;
  std::uniform_real_distribution<double> place(-60, 120);
  for (int k = 0; k < 2000; ++k) {
    // Along a line that crosses grid lines: no jump that is not a slope. Posts of these heights
    // differ by 1500 m at most.
    const double lon = std::round(place(random)) - kStep / 2,
                 lat = std::clamp(place(random), -80.0, 80.0);
    const Geographic two[] = {{lon, lat}, {lon + kStep, lat}};
    double h[2];
    field.filled(two, h);
    EXPECT_LE(std::abs(h[0] - h[1]), 1500 * kStep) << lon << " " << lat;
  }
}

TEST(HeightField, one_by_one_or_together_gives_the_same_heights) {
  std::mt19937 random(4);
  const MadeUpSource source(with_voids(random, 60, 60, 0.3), {0, 59}, 1);
  HeightField with_window(source);
  ASSERT_TRUE(with_window.load(0, 10, 10, 30, 30));
  const HeightField without(source);
  std::uniform_real_distribution<double> place(-70, 80);
  std::vector<Geographic> places;
  for (int k = 0; k < 400; ++k) places.push_back({place(random), place(random)});
  std::vector<double> together(places.size());
  with_window.filled(places, together);
  for (std::size_t k = 0; k < places.size(); ++k) {
    double alone = 0;
    without.filled({&places[k], 1}, {&alone, 1});
    EXPECT_EQ(alone, together[k]);
  }
}

}  // namespace
}  // namespace tind
