#include "terrain/mesh/triangle_plane.h"

#include <gtest/gtest.h>

#include <random>

namespace tind {
namespace {

TEST(TrianglePlane, HasTheSlopesOfThePlaneThatTheCornersLieIn) {
  const auto on = [](double x, double y) { return Vec3{x, y, 7 + 3 * x - 2 * y}; };
  const Vec3 a = on(1, 1), b = on(9, 2), c = on(4, 6);
  EXPECT_EQ(gradient(a, b, c), (Vec2{3, -2}));
  EXPECT_EQ(gradient(a, c, b), (Vec2{3, -2})) << "either orientation";
  const double area = orient2d(a, b, c);
  EXPECT_EQ(slope_times_area(a, b, c), (Vec2{3 * area, -2 * area}));
  EXPECT_EQ(slope_times_area(a, c, b), (Vec2{-3 * area, 2 * area}));
}

TEST(TrianglePlane, GoesThroughItsCorners) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-100, 100);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 a{any(random), any(random), any(random)}, b{any(random), any(random), any(random)},
        c{any(random), any(random), any(random)};
    if (std::abs(orient2d(a, b, c)) < 1) continue;
    const TrianglePlane plane(a, b, c);
    EXPECT_EQ(plane.at(a.x, a.y), a.z) << "the first without any rounding";
    EXPECT_NEAR(plane.at(b.x, b.y), b.z, 1e-8);
    EXPECT_NEAR(plane.at(c.x, c.y), c.z, 1e-8);
    const Vec3 middle = (a + b + c) * (1.0 / 3);
    EXPECT_NEAR(plane.at(middle.x, middle.y), middle.z, 1e-8);
  }
}

}  // namespace
}  // namespace tind
