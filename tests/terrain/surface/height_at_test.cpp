// H at single places, as /elevation has it, where polygons are level.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "terrain/shapes/shaped_dem.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/surface/height_field.h"
#include "tests/support/made_up_source.h"
#include "tests/support/shapes_file.h"

namespace tind {
namespace {

constexpr double kSpacing = 0.001;

/// 60 x 60 posts from 10, 50 to the south-east; a void in the middle.
std::shared_ptr<const DemSource> slopes() {
  HeightGrid grid(60, 60);
  for (int r = 0; r < 60; ++r)
    for (int c = 0; c < 60; ++c) grid.at(c, r) = float(100 + 7 * c + 3 * r + (c * r) % 5);
  for (int r = 28; r < 32; ++r)
    for (int c = 28; c < 32; ++c) grid.at(c, r) = HeightGrid::kVoid;
  return std::make_shared<test::MadeUpSource>(grid, Geographic{10, 50}, kSpacing);
}

/// A lake whose shore is on no post, with an island.
void lake(test::ShapesFile& file) {
  file.polygon({test::square(10.01037, 49.9504, 0.0321), test::square(10.0203, 49.9603, 0.0051)},
               321);
}

TEST(SurfaceHeight, agrees_with_the_flattened_surface_in_cells_that_a_shore_cuts) {
  test::ShapesFile file("height_at");
  lake(file);
  ShapeFiles files;
  files.flatten = {file.write()};
  const auto shaped = shaped_dem(slopes(), files);
  ASSERT_TRUE(shaped) << shaped.error().what;
  const Surface surface(*shaped);
  const HeightField field(surface);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> lon(10, 10.059), lat(49.941, 50);
  int level = 0, cut = 0, dry = 0;
  for (int k = 0; k < 4000; ++k) {
    const Geographic place{lon(random), lat(random)};
    const auto found = height_at(surface, place);
    ASSERT_TRUE(found);
    if (found->height.coverage != Coverage::value) continue;  // of the void outside of the lake
    double h = 0;
    field.at({&place, 1}, {&h, 1});
    EXPECT_NEAR(found->height.height_m, h, 1e-9) << place.lon << " " << place.lat;
    const bool wet = surface.shapes()->level_at(place).has_value();
    if (wet) {
      EXPECT_EQ(found->height.height_m, 321);
    }
    const auto alone = height_at(**shaped, place);  // what the posts alone would say
    ASSERT_TRUE(alone);
    cut += wet && (alone->coverage != Coverage::value || std::abs(alone->height_m - 321) > 0.1);
    wet ? ++level : ++dry;
  }
  EXPECT_GT(level, 500);
  EXPECT_GT(dry, 500);
  EXPECT_GT(cut, 50);  // else nothing was shown
}

TEST(SurfaceHeight, of_water_ends_with_the_dem_and_the_boundary) {
  test::ShapesFile file("height_at_wide"), land("height_at_land");
  file.polygon({test::square(9.9, 49.9, 0.3)}, 50);
  land.polygon({{{10, 49.9}, {10.03, 49.9}, {10.03, 50.1}, {10, 50.1}}});
  ShapeFiles files;
  files.flatten = {file.write()};
  files.boundary = {land.write()};
  const auto shaped = shaped_dem(slopes(), files);
  ASSERT_TRUE(shaped) << shaped.error().what;
  const Surface surface(*shaped);
  const auto at = [&](double lon, double lat) { return height_at(surface, {lon, lat})->height; };
  EXPECT_EQ(at(9.95, 49.97).coverage, Coverage::outside);
  EXPECT_EQ(at(10.05, 49.97).coverage, Coverage::void_);
  EXPECT_EQ(at(10.0123, 49.9777).height_m, 50);
  EXPECT_EQ(at(10.0295, 49.9705).coverage, Coverage::value);  // a void of the DEM, under water
  EXPECT_EQ(at(10.0295, 49.9705).height_m, 50);
}

}  // namespace
}  // namespace tind
