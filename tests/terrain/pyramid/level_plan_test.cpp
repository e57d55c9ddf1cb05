// What is decided before the first tile: how deep the levels go.

#include "terrain/pyramid/plan/level_plan.h"

#include <gtest/gtest.h>

#include "tests/support/made_up_source.h"

namespace tind {
namespace {

using test::MadeUpSource;

int deepest_level(double north, double spacing_deg) {
  const MadeUpSource source(HeightGrid(50, 50), {10, north}, spacing_deg);
  const auto plan = TilePlan::make(source, HeightRange{}, {});
  EXPECT_TRUE(plan);
  return plan->max_level();
}

TEST(TilePlan, levels_go_as_deep_at_the_poles_as_elsewhere) {
  const int middle = deepest_level(50, 1e-4);
  EXPECT_EQ(deepest_level(85, 1e-4), middle);
  EXPECT_EQ(deepest_level(90, 1e-4), middle);
  EXPECT_EQ(deepest_level(-89.995, 1e-4), middle);
}

/// Clients fly to the bounds: an area, even of one post.
TEST(TilePlan, bounds_of_a_single_row_or_column_have_an_area) {
  for (const auto& [cols, rows] : {std::pair{1, 1}, {1, 50}, {50, 1}, {50, 50}})
    for (const Geographic corner : {Geographic{10, 46}, {-180, 90}, {180, -85}}) {
      const MadeUpSource source(HeightGrid(cols, rows), corner, 1e-3);
      const auto plan = TilePlan::make(source, HeightRange{}, {});
      ASSERT_TRUE(plan) << plan.error().what;
      const auto [west, south, east, north] = plan->layer("").bounds;
      EXPECT_LT(west, east);
      EXPECT_LT(south, north);
      const GeoRect& posts = source.info().bounds;
      EXPECT_GE(west, std::max(-180.0, posts.west - 0.51e-3));
      EXPECT_LE(west, posts.west);
      EXPECT_GE(north, posts.north);
      EXPECT_LE(north, std::min(90.0, posts.north + 0.51e-3));
      if (cols > 1) {
        EXPECT_EQ(west, posts.west);
      }
      if (rows > 1) {
        EXPECT_EQ(north, posts.north);
      }
    }
}

}  // namespace
}  // namespace tind
