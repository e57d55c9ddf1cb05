// Boxes around rectangles, the shorter way around the earth.

#include "terrain/geo/extent_box.h"

#include <gtest/gtest.h>

#include <vector>

namespace tind {
namespace {

using Rects = std::vector<GeoRect>;

TEST(ExtentBox, LeavesOutTheWidestGap) {
  EXPECT_EQ(box_around(Rects{{7, 45, 8, 46}}), (GeoRect{7, 45, 8, 46}));
  EXPECT_EQ(box_around(Rects{{7, 45, 8, 46}, {-3, 40, 2, 41}}), (GeoRect{-3, 40, 8, 46}));
  EXPECT_EQ(box_around(Rects{{-180, -20, -179, -10}, {178, -21, 180, -15}}),
            (GeoRect{178, -21, 181, -10}));
  EXPECT_EQ(box_around(Rects{{170, 0, 171, 1}, {-170, 0, -160, 1}, {-165, 2, -150, 3}}),
            (GeoRect{170, 0, 210, 3}));
  EXPECT_EQ(box_around(Rects{{-180, -90, 180, 90}}), (GeoRect{-180, -90, 180, 90}));
  EXPECT_EQ(box_around(Rects{{-180, 0, 10, 1}, {-20, 0, 180, 1}}), (GeoRect{-180, 0, 180, 1}));
}

TEST(ExtentBox, APlaceIsWhereThereIsSomething) {
  EXPECT_EQ(place_in(Rects{{7, 45, 8, 46}}), (Geographic{7.5, 45.5}));
  EXPECT_EQ(place_in(Rects{{-180, -20, -177, -10}, {178, -20, 180, -10}}),
            (Geographic{-179.5, -15}));
  // An archipelago whose middle is water: its largest island.
  EXPECT_EQ(place_in(Rects{{0, 0, 1, 1}, {10, 0, 12, 1}, {30, 0, 31, 1}}), (Geographic{11, .5}));
}

}  // namespace
}  // namespace tind
