#include "terrain/analysis/viewshed.h"

#include <gtest/gtest.h>

#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::MadeUpSource;

TEST(Viewshed, IsTheLineOfSightToEveryPost) {
  const MadeUpSource dem(test::rough_terrain(31, 27, 9, 300), {10, 50}, 0.001);
  ViewshedOptions options{{{10.0123, 49.9871}, 5}, 2};
  for (const double e : {0.0, 1.0}) {
    options.rules.uncertainty_m = e;
    const auto seen = viewshed(dem, dem.grid(), options);
    ASSERT_TRUE(seen) << seen.error().what;
    std::size_t count[3] = {};
    for (int r = 0; r < 27; ++r)
      for (int c = 0; c < 31; ++c) {
        const Vec2 at = dem.info().post_to_crs.apply(c, r);
        const auto line = line_of_sight(dem, options.observer, {{at.x, at.y}, 2}, options.rules);
        ASSERT_TRUE(line);
        ASSERT_EQ(seen->visibility.at(c, r), float(int(line->visibility))) << c << " " << r;
        ++count[int(line->visibility)];
      }
    EXPECT_EQ(seen->hidden, count[0]);
    EXPECT_EQ(seen->visible, count[1]);
    EXPECT_EQ(seen->depends, count[2]);
    EXPECT_GT(seen->hidden, 20u);
    EXPECT_GT(seen->visible, 20u);
    EXPECT_EQ(seen->depends > 0, e > 0);
  }
}

TEST(Viewshed, OnFlatLandReachesTheRim) {
  const MadeUpSource dem(HeightGrid(21, 21, 100), {10, 50}, 0.001);
  const auto seen = viewshed(dem, dem.grid(), {.observer = {{10.01, 49.99}, 2}});
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->visible, 441u);
}

TEST(Viewshed, EndsAtItsRadiusAndInVoids) {
  HeightGrid grid(81, 81, 100);
  grid.at(41, 41) = HeightGrid::kVoid;
  const auto dem = std::make_shared<const MadeUpSource>(grid, Geographic{10, 50}, 0.001);
  ViewshedOptions options{{{10.03, 49.96}, 30}, 0, 1500};
  const auto around = dem_around(dem, options);
  ASSERT_TRUE(around) << around.error().what;
  EXPECT_LT((*around)->info().cols, 60);
  const auto posts =
      (*around)->read(0, 0, int((*around)->info().cols), int((*around)->info().rows));
  ASSERT_TRUE(posts);
  const auto seen = viewshed(**around, *posts, options);
  ASSERT_TRUE(seen);
  const double degree_x = 71'800, degree_y = 111'200;  // metres, here
  const double all = M_PI * 1500 * 1500 / (degree_x * degree_y * 1e-6);
  EXPECT_NEAR(double(seen->visible + seen->hidden + seen->depends), all, 0.03 * all);
  EXPECT_GT(seen->depends, 0u);  // behind the void
  EXPECT_EQ(seen->hidden, 0u);
}

}  // namespace
}  // namespace tind
