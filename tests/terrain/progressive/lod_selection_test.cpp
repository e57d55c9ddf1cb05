#include "terrain/progressive/multires/lod_selection.h"

#include <gtest/gtest.h>

#include <numbers>

namespace tind {
namespace {

TEST(LodSelection, AtThatDistanceAnErrorProjectsToTheTolerance) {
  for (const double fov_deg : {20.0, 60.0, 120.0}) {
    const double fov = fov_deg * std::numbers::pi / 180;
    const double distance = 8 * distance_per_error(1080, fov, 2);
    const double picture_m = 2 * std::tan(fov / 2) * distance;  // what 1080 pixels show there
    EXPECT_NEAR(8 / picture_m * 1080, 2, 1e-12);
  }
}

TEST(LodSelection, AFinerToleranceOrALongerLensNeedsMoreDistance) {
  const double usual = distance_per_error(1000, 1, 2);
  EXPECT_DOUBLE_EQ(distance_per_error(1000, 1, 1), 2 * usual);
  EXPECT_DOUBLE_EQ(distance_per_error(2000, 1, 2), 2 * usual);
  EXPECT_GT(distance_per_error(1000, 0.5, 2), 2 * usual);
}

}  // namespace
}  // namespace tind
