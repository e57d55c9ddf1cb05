#include "terrain/tile/normals.h"

#include <gtest/gtest.h>

#include <random>

#include "terrain/geo/ellipsoid.h"

namespace tind {
namespace {

using Code = std::array<std::uint8_t, 2>;

TEST(Normals, KnownCodes) {
  // 0 lies between 127 and 128 and is rounded up, as JavaScript's Math.round does
  EXPECT_EQ(oct_encode({0, 0, 1}), (Code{128, 128}));
  EXPECT_EQ(oct_encode({0, 0, -1}), (Code{255, 255}));
  EXPECT_EQ(oct_encode({1, 0, 0}), (Code{255, 128}));
  EXPECT_EQ(oct_encode({-1, 0, 0}), (Code{0, 128}));
  EXPECT_EQ(oct_encode({0, -1, 0}), (Code{128, 0}));
}

TEST(Normals, CodesStayWithinADegree) {
  std::mt19937 random(1);
  std::normal_distribution<double> number;
  double worst = 0;
  for (int i = 0; i < 100000; ++i) {
    Vec3 v{number(random), number(random), number(random)};
    v = v * (1 / length(v));
    const Vec3 back = oct_decode(oct_encode(v));
    worst = std::max(worst, std::atan2(length(cross(v, back)), dot(v, back)) * 57.29577951308232);
  }
  EXPECT_LT(worst, 0.95);
}

TEST(Normals, EveryCodeIsAUnitVector) {
  for (int a = 0; a < 256; ++a)
    for (int b = 0; b < 256; ++b)
      ASSERT_NEAR(length(oct_decode({std::uint8_t(a), std::uint8_t(b)})), 1, 1e-12);
}

TEST(Normals, FlatGroundPointsUp) {
  const Vec3 n = ecef_normal({-122, 42}, 0, 0);
  EXPECT_NEAR(length(n - wgs84::up({-122, 42})), 0, 1e-15);
}

TEST(Normals, SlopesLeanAwayFromTheRise) {
  // 45 degrees up to the east on the equator at longitude 0: up is +x, east is +y.
  const Vec3 east = ecef_normal({0, 0}, 1, 0);
  EXPECT_NEAR(east.x, std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(east.y, -std::sqrt(0.5), 1e-12);
  const Vec3 north = ecef_normal({0, 0}, 0, 1);
  EXPECT_NEAR(north.z, -std::sqrt(0.5), 1e-12);
}

}  // namespace
}  // namespace tind
