#include "terrain/analysis/viewshed.h"

#include <gtest/gtest.h>

#include "tests/support/made_up_source.h"
#include "tests/support/support.h"
#include "tests/support/text_dem.h"

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

TEST(Viewshed, AnUncertaintyOfNearlyNothingChangesNearlyNothing) {
  // A slope that faces the eye: nothing is hidden, and targets stand on the ground.
  HeightGrid grid(41, 41);
  for (int r = 0; r < 41; ++r)
    for (int c = 0; c < 41; ++c) grid.at(c, r) = float(100 + 5 * c);
  const MadeUpSource dem(std::move(grid), {10, 50}, 0.0004);
  ViewshedOptions options{{{10.0001, 49.9999}, 150}};
  for (const double e : {0.0, 1e-9, 0.001, 0.1}) {
    options.rules.uncertainty_m = e;
    const auto seen = viewshed(dem, dem.grid(), options);
    ASSERT_TRUE(seen);
    EXPECT_EQ(seen->visible, 1681u) << e;
  }
}

TEST(Viewshed, GoesOnBeyondTheSeamOfADemAroundTheGlobe) {
  const test::TempDir folder;
  const auto dem = test::text_dem(folder, "globe", HeightGrid(720, 21, 100), {-180, 45}, 0.5);
  ASSERT_TRUE(dem->info().wraps_longitude);
  const auto posts = dem->read(0, 0, 720, 21);
  ASSERT_TRUE(posts);
  ViewshedOptions options{{{179.8, 50}, 20000}, 0, 400e3};
  const auto seen = viewshed(*dem, *posts, options);
  ASSERT_TRUE(seen) << seen.error().what;
  EXPECT_GT(seen->visible, 50u);
  for (const double lon : {179.0, 179.5, -180.0, -179.5, -179.0}) {
    const auto line = line_of_sight(*dem, options.observer, {{lon, 50}, 0}, options.rules);
    ASSERT_TRUE(line);
    EXPECT_EQ(seen->visibility.at(int((lon + 180) / 0.5), 10), float(int(line->visibility))) << lon;
    EXPECT_EQ(line->visibility, Visibility::visible) << lon;
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
