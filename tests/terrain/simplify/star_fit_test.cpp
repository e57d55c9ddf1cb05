#include "terrain/simplify/common/star_fit.h"

#include <gtest/gtest.h>

#include <array>
#include <numbers>
#include <vector>

#include "terrain/simplify/common/samples.h"

namespace tind {
namespace {

/// A pyramid over a hexagon, and samples of it everywhere.
class StarFitTest : public testing::Test {
 protected:
  static constexpr Vec3 kTop = {32, 30, 20};
  std::vector<Vec3> ring_;
  std::vector<float> heights_;
  GridSamples samples_;

  StarFitTest() : heights_(64 * 64) {
    for (int k = 0; k < 6; ++k) {
      const double angle = k * std::numbers::pi / 3;
      ring_.push_back({31 + 25 * std::cos(angle), 31 + 25 * std::sin(angle), double(k % 2)});
    }
    samples_.cols = samples_.rows = 64;
    samples_.y0 = 63;
    for (int row = 0; row < 64; ++row)
      for (int col = 0; col < 64; ++col)
        heights_[row * 64 + col] = float(height(kTop, col, 63 - row));
    samples_.z = heights_.data();
  }

  /// Of the pyramid with this apex; NaN beside it.
  double height(const Vec3& w, double x, double y) const {
    const Vec3 p{x, y, 0};
    for (std::size_t k = 0; k < 6; ++k) {
      const Vec3 &a = ring_[k], &b = ring_[(k + 1) % 6];
      if (orient2d(w, a, p) >= 0 && orient2d(a, b, p) >= 0 && orient2d(b, w, p) >= 0)
        return TrianglePlane(w, a, b).at(x, y);
    }
    return std::nan("");
  }
  StarFit fit(const Vec3& w) const {
    StarFit f;
    for (std::size_t k = 0; k < 6; ++k) f.add(samples_, w, ring_[k], ring_[(k + 1) % 6]);
    return f;
  }
};

TEST_F(StarFitTest, WhereAllSamplesFitThereIsNothingToDo) {
  const StarFit f = fit(kTop);
  EXPECT_NEAR(f.sum, 0, 1e-8);
  EXPECT_NEAR(f.rise(), 0, 1e-6);
  EXPECT_NEAR(f.step().x, 0, 1e-5);
  EXPECT_NEAR(f.step().y, 0, 1e-5);
  EXPECT_NEAR(f.reach, 26, 1);
}

TEST_F(StarFitTest, RisesToTheHeightThatSquaresAskFor) {
  const StarFit f = fit({kTop.x, kTop.y, kTop.z - 3});
  EXPECT_NEAR(f.rise(), 3, 1e-3);
  EXPECT_NEAR(f.sum_after_rise(), 0, 1e-3 * f.sum);
  EXPECT_GT(f.sum, 100);
}

TEST_F(StarFitTest, TheSumAfterARiseIsWhatIsMeasuredThere) {
  const Vec3 w{kTop.x + 2, kTop.y - 1, kTop.z + 1};
  const StarFit f = fit(w);
  const StarFit there = fit({w.x, w.y, w.z + f.rise()});
  EXPECT_NEAR(f.sum_after_rise(), there.sum, 1e-6 * f.sum);
  EXPECT_LT(there.sum, f.sum);
}

TEST_F(StarFitTest, StepsLeadBackToThePlaceThatFits) {
  Vec3 w{kTop.x + 4, kTop.y - 3, kTop.z};
  const double before = fit(w).sum_after_rise();
  for (int k = 0; k < 8; ++k) {
    const StarFit f = fit(w);
    const Vec2 s = f.step_inside();
    w = {w.x + s.x, w.y + s.y, w.z + f.rise()};
  }
  EXPECT_NEAR(w.x, kTop.x, 0.2);
  EXPECT_NEAR(w.y, kTop.y, 0.2);
  EXPECT_LT(fit(w).sum_after_rise(), 0.01 * before);
}

TEST_F(StarFitTest, AStepEndsHalfwayToTheRingAtTheFarthest) {
  StarFit f;
  f.xx = f.yy = 1e-6, f.x = 100;
  f.reach = 10;
  EXPECT_GT(f.step().x, 1000);
  EXPECT_DOUBLE_EQ(f.step_inside().x, 5);
  EXPECT_EQ(StarFit().step(), (Vec2{0, 0})) << "no samples, no way to go";
  StarFit first = StarFit::for_step();
  first.xx = first.yy = 1e-6, first.x = 100;
  EXPECT_EQ(first.step(), f.step()) << "the prior counts once, first or last";
}

}  // namespace
}  // namespace tind
