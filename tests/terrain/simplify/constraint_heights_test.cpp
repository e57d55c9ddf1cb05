#include "terrain/simplify/constraints/constraint_heights.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

#include "terrain/raster/interpolate.h"
#include "tests/support/support.h"

namespace tind {
namespace {

TEST(HeightBetweenPosts, IsTheHeightThatEverythingElseHasWhereThereIsOne) {
  std::mt19937 random(7);
  const auto share = [&] { return double(random() % 5) / 4; };
  int continued = 0;
  for (int round = 0; round < 20000; ++round) {
    HeightGrid grid(2, 2);
    for (float& z : grid.values())
      if (random() % 4 != 0) z = float(random() % 100) / 7;
    const double fx = share(), fy = share();
    const double rule =
        height_between(grid.at(0, 0), grid.at(1, 0), grid.at(0, 1), grid.at(1, 1), fx, fy);
    const double got = height_between_posts(grid, fx, -fy);
    if (!std::isnan(rule)) {
      ASSERT_EQ(std::bit_cast<std::uint64_t>(got), std::bit_cast<std::uint64_t>(rule));
    } else {
      continued += !std::isnan(got);
    }
  }
  EXPECT_GT(continued, 1000);
}

TEST(HeightBetweenPosts, GoesOnWithoutAStepWhereItIsVoid) {
  const HeightGrid grid = test::grid_from("1 3 / 7 .");
  // Across the diagonal beyond which the fourth post would be needed.
  for (const double e : {1e-6, 1e-3, 0.4})
    EXPECT_NEAR(height_between_posts(grid, 0.5 + e, -(0.5 + e)), 5 + 8 * e, 1e-9);
  EXPECT_NEAR(height_between_posts(grid, 1, -1), 9, 1e-9);
}

}  // namespace
}  // namespace tind
