#include "proto/image/height_colours.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tind::proto {
namespace {

TEST(HeightColours, AreTheNearestThatTheyCanSay) {
  for (const HeightCode code : {HeightCode::mapbox, HeightCode::terrarium})
    for (const double metres : {-9999.9, -430.0, 0.0, 0.049, 8848.86, 12345.678})
      EXPECT_NEAR(height_of(height_colour(metres, code), code), metres,
                  height_step_m(code) / 2 + 1e-9);
}

TEST(HeightColours, BeyondTheirRangeTheyStandAtItsEnd) {
  const std::array<std::uint8_t, 3> black{0, 0, 0};
  for (const double deep : {-10000.0, -10000.04, -10915.0, -HUGE_VAL}) {
    EXPECT_NE(height_colour(deep, HeightCode::mapbox), black) << "which many take for no data";
    EXPECT_NEAR(height_of(height_colour(deep, HeightCode::mapbox), HeightCode::mapbox), -9999.9,
                1e-9);
  }
  const std::vector<float> trench{100.f, -10915.f, -9999.f}, land{-430.f, 8848.f};
  EXPECT_NEAR(beyond_range_m(trench, HeightCode::mapbox), 10915 - 9999.95, 1e-3);
  EXPECT_EQ(beyond_range_m(trench, HeightCode::terrarium), 0);
  EXPECT_EQ(beyond_range_m(land, HeightCode::mapbox), 0);
  EXPECT_NEAR(beyond_range_m(std::vector<float>{1'700'000.f}, HeightCode::mapbox),
              1'700'000 - 1'667'721.55, 0.1);
}

}  // namespace
}  // namespace tind::proto
