// Where a source is lowest and highest: from its posts, and down an index of them.

#include "terrain/pyramid/plan/height_extremes.h"

#include <gtest/gtest.h>

#include <random>

#include "terrain/pyramid/plan/plan_source.h"
#include "tests/support/made_up_source.h"

namespace tind {
namespace {

/// Rough ground of `side` x `side` posts, with one summit and one pit that stand out.
HeightGrid rough(int side, int summit_col, int summit_row, int pit_col, int pit_row) {
  HeightGrid grid(side, side);
  std::mt19937 random(7);
  for (float& z : grid.values()) z = float(random() % 1000);
  grid.at(summit_col, summit_row) = 1500;
  grid.at(pit_col, pit_row) = -20;
  return grid;
}

void expect_at(const DemSource& source, const HeightExtremes::Place& place, int col, int row,
               double height_m) {
  std::vector<Vec2> post(1);
  source.to_post(std::vector{place.where}, post);
  EXPECT_NEAR(post[0].x, col, 1e-6);
  EXPECT_NEAR(post[0].y, row, 1e-6);
  EXPECT_EQ(place.height_m, height_m);
}

TEST(HeightExtremes, AreWhereThePostsAre) {
  for (const double turn : {0.0, 0.3}) {
    const test::MadeUpSource source(rough(600, 599, 3, 17, 598), {7, 46}, 0.001, turn);
    const auto plan = plan_source(source, {}, "");
    ASSERT_TRUE(plan) << plan.error().what;
    ASSERT_EQ(plan->index(), nullptr);
    const auto found = find_extremes(source, *plan);
    ASSERT_TRUE(found) << found.error().what;
    expect_at(source, found->highest, 599, 3, 1500);
    expect_at(source, found->lowest, 17, 598, -20);
  }
}

TEST(HeightExtremes, AreFoundDownTheIndex) {
  for (const double turn : {0.0, 0.3}) {
    const test::MadeUpSource source(rough(600, 599, 3, 17, 598), {7, 46}, 0.001, turn);
    const auto plan = plan_source(source, {.exact_posts = 20'000}, "");
    ASSERT_TRUE(plan) << plan.error().what;
    ASSERT_NE(plan->index(), nullptr);
    ASSERT_FALSE(plan->range().highest);
    const auto found = find_extremes(source, *plan);
    ASSERT_TRUE(found) << found.error().what;
    expect_at(source, found->highest, 599, 3, 1500);
    expect_at(source, found->lowest, 17, 598, -20);
  }
}

TEST(HeightExtremes, OfSeveralTheFirstWhateverTheThreads) {
  HeightGrid grid(5000, 600, 3);  // six pieces over the posts
  grid.at(4500, 300) = 9, grid.at(100, 500) = 9;
  grid.at(4999, 599) = HeightGrid::kVoid;
  const test::MadeUpSource source(std::move(grid), {7, 46}, 0.0005);
  for (const int threads : {1, 2, 4}) {
    const auto range = read_height_range(source, {}, threads);
    ASSERT_TRUE(range);
    EXPECT_EQ(range->valid, 5000u * 600 - 1);
    EXPECT_EQ(range->highest->col, 100) << threads;  // of the first piece
    EXPECT_EQ(range->highest->row, 500);
    EXPECT_EQ(range->lowest->col, 0);
    EXPECT_EQ(range->lowest->row, 0);
  }
}

}  // namespace
}  // namespace tind
