#include "terrain/geo/line_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "terrain/geo/longitude.h"

namespace tind {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

TEST(LineParts, AreCutAtTheAntimeridianInEitherDirection) {
  for (const double side : {180., -180.}) {
    const double step = side / 180;
    const LinePoint line[] = {{{side - step, 10}, 100}, {{-side + step, 20}, 200}};
    const auto parts = line_parts(line);
    ASSERT_EQ(parts.size(), 2u);
    ASSERT_EQ(parts[0].size(), 2u);
    ASSERT_EQ(parts[1].size(), 2u);
    EXPECT_EQ(parts[0][1].place.lon, side);
    EXPECT_EQ(parts[1][0].place.lon, -side);
    for (const LinePoint& at : {parts[0][1], parts[1][0]}) {
      EXPECT_DOUBLE_EQ(at.place.lat, 15);
      EXPECT_DOUBLE_EQ(at.height_m, 150);
    }
  }
}

TEST(LineParts, OfALineThatCrossesNothingAreOne) {
  const LinePoint line[] = {{{-90, 0}, 1}, {{0, 0}, kNone}, {{90, 0}, 3}};
  ASSERT_EQ(line_parts(line).size(), 1u);
  EXPECT_EQ(line_parts(line)[0].size(), 3u);
  EXPECT_FALSE(has_all_heights(line));
  EXPECT_TRUE(has_all_heights(std::span(line).first(1)));
  ASSERT_EQ(line_parts({}).size(), 1u);
  EXPECT_TRUE(line_parts({})[0].empty());
}

TEST(LineParts, BesideAVoidTheCutHasNoHeight) {
  const LinePoint line[] = {{{179, 0}, kNone}, {{-179, 0}, 3}};
  EXPECT_TRUE(std::isnan(line_parts(line)[0][1].height_m));
}

TEST(Longitude, TheNearestTurnIsTheSamePlace) {
  EXPECT_EQ(nearest_turn(-179, 181, 360), 181);
  EXPECT_EQ(nearest_turn(541, -170, 360), -179);
  EXPECT_EQ(nearest_turn(10, 20, 360), 10);
}

}  // namespace
}  // namespace tind
