// Networks of random and of degenerate segments: what comes out never crosses.

#include "terrain/mesh/constrained_delaunay.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace tind {
namespace {

constexpr double kNoHeight = std::numeric_limits<double>::quiet_NaN();

void add(LineNetwork& n, double ax, double ay, double bx, double by) {
  const auto at = std::uint32_t(n.points.size());
  for (const auto& [x, y] : {std::pair{ax, ay}, {bx, by}})
    n.points.push_back({snap_to_line_lattice(x), snap_to_line_lattice(y), kNoHeight});
  n.segments.push_back({at, at + 1, std::uint32_t(n.segments.size())});
}

/// A triangulation of the network needs no point of its own, and its triangles cover the hull.
void expect_no_crossings(const LineNetwork& n) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (const LineSegment& s : n.segments) edges.push_back({s.a, s.b});
  std::vector<Vec3> points = n.points;
  const auto triangles = triangulate(points, edges);
  ASSERT_TRUE(triangles);
  EXPECT_EQ(points.size(), n.points.size());
  for (const Triangle& t : *triangles)
    EXPECT_GT(orient2d(points[t[0]], points[t[1]], points[t[2]]), 0);
}

class Lines : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_constrained_delaunay()) GTEST_SKIP() << "built without CGAL";
  }
};

TEST_F(Lines, CrossingBecomesAVertexWithTheFirstLinesHeight) {
  LineNetwork n;
  add(n, 0, 0, 2, -2);
  add(n, 0, -2, 2, 0);
  n.points[0].z = 10, n.points[1].z = 20;
  const auto repairs = repair_lines(n);
  ASSERT_TRUE(repairs);
  EXPECT_EQ(repairs->crossings, 1u);
  ASSERT_EQ(n.points.size(), 5u);
  EXPECT_EQ(n.points[4], (Vec3{1, -1, 15}));
  EXPECT_EQ(n.segments.size(), 4u);
}

TEST_F(Lines, WhatIsAHairApartMeets) {
  LineNetwork n;
  add(n, 0, 0, 10, 0);
  add(n, 5, 1e-4, 5, 3);    // ends a hair beside the first
  add(n, 10, 1e-4, 12, 0);  // begins a hair beside the first one's end
  const auto repairs = repair_lines(n);
  ASSERT_TRUE(repairs);
  EXPECT_EQ(repairs->bent, 1u);
  EXPECT_EQ(repairs->joined, 1u);
  EXPECT_EQ(n.segments.size(), 4u);
  expect_no_crossings(n);
}

TEST_F(Lines, OverlapsAndDuplicatesShareTheirStretch) {
  LineNetwork n;
  add(n, 0, 0, 4, 0);
  add(n, 2, 0, 6, 0);
  add(n, 4, 0, 0, 0);
  ASSERT_TRUE(repair_lines(n));
  // 0-2 and 2-4 twice (by 0 and 2), 2-4 and 4-6 by 1.
  EXPECT_EQ(n.segments.size(), 6u);
  expect_no_crossings(n);
}

TEST_F(Lines, WhatASourceRunsAlongTwiceIsThereTwice) {
  LineNetwork n;
  for (const auto& [ax, bx] : {std::pair{0, 4}, {4, 0}, {0, 4}, {6, 8}, {8, 6}}) {
    add(n, ax, 0, bx, 0);
    n.segments.back().source = 0;
  }
  ASSERT_TRUE(repair_lines(n));
  EXPECT_EQ(n.segments.size(), 3u);  // 0-4 thrice is once, 6-8 twice is twice
}

// Ends nearer to each other than the tolerance on two lines far apart: entered in their order, each
// segment would turn over what the rest will cross: minutes in place of a second.
TEST_F(Lines, ADenseZigzagBecomesANetwork) {
  LineNetwork n;
  const auto corner = [](int i) { return std::pair{i / 2500.0, i % 2 ? -1.3 : 0.0}; };
  for (int i = 1; i < 100'000; ++i)
    add(n, corner(i - 1).first, corner(i - 1).second, corner(i).first, corner(i).second);
  ASSERT_TRUE(repair_lines(n));
  EXPECT_GT(n.segments.size(), 10'000u);
  expect_no_crossings(n);
}

TEST_F(Lines, AnyDirtBecomesANetwork) {
  std::mt19937 random(5);
  for (int round = 0; round < 60; ++round) {
    LineNetwork n;
    std::uniform_real_distribution<double> place(0, 20), hair(-2e-3, 2e-3);
    for (int i = 0; i < 40; ++i) {
      const bool whole = random() % 3 == 0;  // on posts: many exact coincidences
      const auto at = [&] { return whole ? std::floor(place(random)) : place(random); };
      double ax = at(), ay = -at(), bx = at(), by = -at();
      if (random() % 4 == 0 && i > 0) {  // a near copy of an earlier segment
        const LineSegment& s = n.segments[random() % n.segments.size()];
        ax = n.points[s.a].x + hair(random), ay = n.points[s.a].y + hair(random);
        bx = n.points[s.b].x + hair(random), by = n.points[s.b].y;
      }
      add(n, ax, ay, bx, by);
    }
    LineNetwork again = n;
    const auto repairs = repair_lines(n);
    ASSERT_TRUE(repairs);
    EXPECT_EQ(repairs->dropped, 0u) << round;
    expect_no_crossings(n);
    ASSERT_TRUE(repair_lines(again));
    EXPECT_EQ(n.segments, again.segments);
  }
}

}  // namespace
}  // namespace tind
