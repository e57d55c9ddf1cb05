#include "terrain/progressive/multires/lod_selection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tind {
namespace {

const double kFrom[] = {0, 1000, 2000, 4000};

int switches(double hysteresis) {
  int shown = -1, count = 0;
  for (int frame = 0; frame < 600; ++frame) {
    const double distance = 2000 + 30 * std::sin(0.7 * frame);
    const int now = select_level(kFrom, distance, shown, hysteresis);
    count += frame > 10 && now != shown;
    shown = now;
  }
  return count;
}

TEST(LodSelection, AnOscillatingCameraFlickersWithoutHysteresisAndNotWithIt) {
  EXPECT_GT(switches(0), 100);
  EXPECT_EQ(switches(0.1), 0) << "once at the finer level that it needs, it stays";
}

TEST(LodSelection, WhateverItRemembersWhatIsShownIsGoodEnough) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> distance(0, 6000);
  int shown = -1;
  for (int i = 0; i < 10000; ++i) {
    const double d = distance(random);
    shown = select_level(kFrom, d, shown, 0.2);
    ASSERT_LE(kFrom[shown], d);
    const int best = select_level(kFrom, d, -1, 0);
    ASSERT_LE(shown, best);
    ASSERT_GE(shown, select_level(kFrom, d / 1.2, -1, 0)) << "never finer than the margin asks";
  }
}

TEST(LodSelection, ProjectedErrorsAreDistances) {
  const double errors[] = {0.5, 2, 8};
  const auto from = distances_of_errors(errors, 1000, 2);
  EXPECT_EQ(from, (std::vector<double>{0, 1000, 4000}));
  EXPECT_EQ(select_level(from, 1000, -1, 0), 1);
  EXPECT_EQ(select_level(from, 999, -1, 0), 0);
}

}  // namespace
}  // namespace tind
