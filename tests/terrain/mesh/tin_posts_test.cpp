#include "terrain/mesh/tin_posts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tind {
namespace {

constexpr double kFloat = 1e-5;  // of heights about 10, kept as floats

double plane(double x, double y) { return 5 + 0.1 * x + 0.2 * y; }

/// Two triangles of the plane over 40 x 20, from (100, 200).
Tin plane_tin() {
  Tin tin;
  for (const double y : {0.0, 20.0})
    for (const double x : {0.0, 40.0}) tin.vertices.push_back({100 + x, 200 + y, plane(x, y)});
  tin.triangles = {{0, 1, 2}, {1, 3, 2}};
  return tin;
}

/// A square of 4 x 4 on the ground, 10 high in its middle.
Tin pyramid() {
  Tin tin;
  tin.vertices = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {2, 2, 10}};
  tin.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  return tin;
}

std::size_t heights_in(const HeightGrid& grid) {
  std::size_t n = 0;
  for (const float z : grid.values()) n += !std::isnan(z);
  return n;
}

TEST(TinPosts, APlaneIsItselfAtEveryPostAndBetween) {
  const auto posts = tin_posts(plane_tin(), {1, 1, 1}, 7);
  ASSERT_TRUE(posts);
  // 40 / 7 and 20 / 7, rounded up: six steps and three.
  ASSERT_EQ(posts->heights.cols(), 7);
  ASSERT_EQ(posts->heights.rows(), 4);
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 7; ++c) {
      const Vec2 at = posts->post_to_tin.apply(c, r);
      EXPECT_NEAR(at.x, 100 + c * 40.0 / 6, 1e-9);
      EXPECT_NEAR(at.y, 220 - r * 20.0 / 3, 1e-9);
      EXPECT_NEAR(posts->heights.at(c, r), plane(at.x - 100, at.y - 200), kFloat);
    }
  EXPECT_LT(posts->error.max_m(), kFloat);
}

TEST(TinPosts, AStepThatFitsIsKept) {
  const auto posts = tin_posts(plane_tin(), {1, 1, 1}, 0.1);
  ASSERT_TRUE(posts);
  EXPECT_EQ(posts->heights.cols(), 401);
  EXPECT_EQ(posts->heights.rows(), 201);
  EXPECT_EQ(heights_in(posts->heights), posts->heights.size());
}

TEST(TinPosts, WhatBilinearCellsMakeOfAPyramidIsSaid) {
  // One cell knows nothing of the top.
  const auto one = tin_posts(pyramid(), {1, 1, 1}, 4);
  ASSERT_TRUE(one);
  EXPECT_NEAR(one->error.max_above_m, 10, kFloat);
  EXPECT_NEAR(one->error.at.x, 0.5, 1e-9);
  // With n steps, n even, it bends along the edges alone: in the cells on the diagonals 10 / (n /
  // 2) times min(x, y) becomes x y, which is a quarter less in the middle.
  for (const int n : {2, 4, 8}) {
    const auto posts = tin_posts(pyramid(), {1, 1, 1}, 4.0 / n);
    ASSERT_TRUE(posts);
    EXPECT_NEAR(posts->error.max_m(), 5.0 / n, kFloat) << n;
    EXPECT_NEAR(posts->heights.at(n / 2, n / 2), 10, kFloat);
  }
  // With three the middle cell cuts off the top third.
  const auto three = tin_posts(pyramid(), {1, 1, 1}, 1.5);
  ASSERT_TRUE(three);
  EXPECT_NEAR(three->error.max_m(), 10.0 / 3, kFloat);
}

TEST(TinPosts, BeyondTheOutlineThereIsNoHeight) {
  Tin tin;
  tin.vertices = {{0, 0, 1}, {4, 0, 1}, {0, 4, 1}};
  tin.triangles = {{0, 1, 2}};
  const auto posts = tin_posts(tin, {1, 1, 1}, 1);
  ASSERT_TRUE(posts);
  EXPECT_EQ(heights_in(posts->heights), 15u);  // 5 + 4 + 3 + 2 + 1
  for (int r = 0; r < 5; ++r)
    for (int c = 0; c < 5; ++c) EXPECT_EQ(posts->heights.is_void(c, r), c > r) << c << " " << r;
  EXPECT_LT(posts->error.max_m(), kFloat);
}

TEST(TinPosts, UnitsCount) {
  // Of feet up, and of units of 10 m on the ground: 4 of them are 40 m.
  const auto posts = tin_posts(pyramid(), {10, 5, 0.3048}, 10);
  ASSERT_TRUE(posts);
  EXPECT_EQ(posts->heights.cols(), 5);
  EXPECT_EQ(posts->heights.rows(), 3);
  EXPECT_NEAR(posts->heights.at(2, 1), 3.048, kFloat);
}

TEST(TinPosts, AnyNumberOfThreadsGivesTheSame) {
  const auto one = tin_posts(pyramid(), {1, 1, 1}, 0.01, 1);
  const auto three = tin_posts(pyramid(), {1, 1, 1}, 0.01, 3);
  ASSERT_TRUE(one && three);
  EXPECT_TRUE(std::ranges::equal(one->heights.values(), three->heights.values()));
  EXPECT_EQ(one->error.max_m(), three->error.max_m());
}

TEST(TinPosts, TooManyAreRefused) {
  const auto posts = tin_posts(pyramid(), {1, 1, 1}, 1e-4);
  ASSERT_FALSE(posts);
  EXPECT_EQ(posts.error().code, Errc::out_of_range);
  EXPECT_FALSE(tin_posts(pyramid(), {1, 1, 1}, 1e-300));
}

}  // namespace
}  // namespace tind
