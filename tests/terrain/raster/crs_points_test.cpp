// Coordinates in the order of their authority's axes.

#include "terrain/raster/crs_points.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tind {
namespace {

/// swisstopo's fundamental point, the old observatory of Bern, is E 2'600'000, N 1'200'000 in LV95
/// and 46.9510828, 7.4386324 on WGS84 [swisstopo, approximate formulas, good to a metre].
TEST(CrsPoints, KnowsTheSwissGrid) {
  const auto lv95 = CrsPoints::make("EPSG:2056", {8, 47});
  ASSERT_TRUE(lv95) << lv95.error().what;
  EXPECT_TRUE((*lv95)->east_first());
  EXPECT_EQ((*lv95)->axes()[0], "Easting (east)");
  const Vec2 bern{2'600'000, 1'200'000};
  Geographic at;
  (*lv95)->to_geographic({&bern, 1}, {&at, 1});
  EXPECT_NEAR(at.lon, 7.4386324, 2e-5);
  EXPECT_NEAR(at.lat, 46.9510828, 2e-5);
  Vec2 back;
  (*lv95)->from_geographic({&at, 1}, {&back, 1});
  EXPECT_NEAR(back.x, bern.x, 1e-3);
  EXPECT_NEAR(back.y, bern.y, 1e-3);
}

TEST(CrsPoints, TakesLatitudeFirstWhereTheAuthorityDoes) {
  const auto wgs84 = CrsPoints::make("EPSG:4326", {8, 47});
  ASSERT_TRUE(wgs84) << wgs84.error().what;
  EXPECT_FALSE((*wgs84)->east_first());
  EXPECT_NE((*wgs84)->axes()[0].find("north"), std::string::npos);
  const Vec2 point{46.5, 7.25};
  Geographic at;
  (*wgs84)->to_geographic({&point, 1}, {&at, 1});
  EXPECT_NEAR(at.lon, 7.25, 1e-9);
  EXPECT_NEAR(at.lat, 46.5, 1e-9);
}

TEST(CrsPoints, RefusesWhatHasNoPlaces) {
  for (const char* code : {"EPSG:5703", "EPSG:4978", "EPSG:999999", "EPSG:", "epsg.json", "",
                           "EPSG:4326 ", "/vsicurl/http://a/b"}) {
    const auto made = CrsPoints::make(code, {8, 47});
    ASSERT_FALSE(made) << code;
    EXPECT_EQ(made.error().code, Errc::invalid_argument) << code;
  }
}

}  // namespace
}  // namespace tind
