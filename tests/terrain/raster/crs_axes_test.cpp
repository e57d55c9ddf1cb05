#include "terrain/raster/crs_axes.h"

#include <gtest/gtest.h>

#include <string>

#include "terrain/raster/crs_code.h"

namespace tind {
namespace {

constexpr Vec2 kEast{1, 0}, kWest{-1, 0}, kNorth{0, 1}, kSouth{0, -1};

void expect_axes(const std::string& crs, Vec2 x, Vec2 y) {
  const auto code = crs_code(crs);
  const auto axes = crs_axes(crs.starts_with("EPSG:") ? code->wkt : crs);
  ASSERT_TRUE(axes) << axes.error().what;
  EXPECT_EQ(axes->x, x) << crs;
  EXPECT_EQ(axes->y, y) << crs;
}

TEST(CrsAxes, LeadWhereTheSystemCounts) {
  expect_axes("EPSG:32632", kEast, kNorth);
  expect_axes("EPSG:2053", kWest, kSouth);  // Lo 29
  expect_axes("EPSG:2065", kSouth, kWest);  // Krovak
  expect_axes("EPSG:5514", kEast, kNorth);  // Krovak East North
  expect_axes("+proj=utm +zone=33 +axis=wnu +type=crs", kWest, kNorth);
  expect_axes("+proj=longlat +axis=wsu +type=crs", kWest, kSouth);
}

TEST(CrsAxes, OfNorthingsBeforeEastingsAreInTheOrderOfGis) {
  expect_axes("EPSG:4326", kEast, kNorth);
  expect_axes("EPSG:31467", kEast, kNorth);
}

TEST(CrsAxes, AroundAPoleAreThoseOfTheGrid) {
  for (const char* const crs : {"EPSG:3031", "EPSG:3413", "EPSG:32661", "EPSG:5041"})
    expect_axes(crs, kEast, kNorth);
}

TEST(CrsAxes, OfASystemWithAShiftAreItsOwn) {
  expect_axes("+proj=tmerc +lon_0=29 +ellps=bessel +towgs84=1,2,3 +axis=wsu +type=crs", kWest,
              kSouth);
}

TEST(CrsAxes, OfNoSystemAreEastAndNorth) {
  expect_axes("", kEast, kNorth);
  expect_axes("nothing that PROJ knows", kEast, kNorth);
}

}  // namespace
}  // namespace tind
