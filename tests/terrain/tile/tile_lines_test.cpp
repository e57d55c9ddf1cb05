#include "terrain/tile/tile_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "terrain/surface/post_warp.h"

namespace tind {
namespace {

/// A closed shore with many points around a corner that four tiles of level 4 share.
ShapeLines wiggly(double radius, std::uint32_t count = 400) {
  ShapeChain chain;
  chain.level_m = 123.4;
  for (std::uint32_t k = 0; k <= count; ++k) {
    const double a = 2 * M_PI * (k % count) / count;
    const double r = radius * (1 + 0.2 * std::sin(40 * a));
    chain.points.push_back(
        {22.5 + r * std::cos(a) + 1e-9, 45 + r * std::sin(a) + 1e-9, std::nan("")});
  }
  return ShapeLines({chain}, {{2 * radius, 0}});
}

constexpr LineScale kAll{.least_deg = 0, .relief_m = 0, .finest_deg = 0, .step_m = 0.25};

std::array<CrossingVertices, 4> crossings(const ShapeLines& lines, TileId id, int gap) {
  std::array<CrossingVertices, 4> sides;
  for (const TileSide side : {TileSide::west, TileSide::south, TileSide::east, TileSide::north}) {
    const TileEdge edge = tile_edge(id, side);
    sides[std::size_t(side)] = CrossingVertices(lines.crossings(edge.start, edge.end, kAll), gap);
  }
  return sides;
}

TEST(CrossingVertices, near_ones_of_one_height_become_one) {
  const std::vector<ShapeCrossing> given{{0.2, 5, true},    {100, 5, true}, {109, 5, true},
                                         {111, 5, true},    {112, 6, true}, {112.2, 4, true},
                                         {32766.9, 5, true}};
  const CrossingVertices vertices(given, 10);
  std::vector<std::pair<int, double>> all;
  for (const auto& v : vertices.all()) all.push_back({v.t, v.height_m});
  EXPECT_EQ(
      all, (std::vector<std::pair<int, double>>{{1, 5}, {100, 5}, {111, 5}, {112, 4}, {32766, 5}}));
  EXPECT_EQ(vertices.of(109)->t, 100);
  EXPECT_EQ(vertices.of(112.2)->t, 112);
  EXPECT_EQ(CrossingVertices().of(3), nullptr);
}

TEST(TileLines, neighbours_meet_at_the_vertices_of_their_edge) {
  const ShapeLines lines = wiggly(3);
  const TileId west{4, 17, 12}, east{4, 18, 12};
  const auto of_west = crossings(lines, west, 30), of_east = crossings(lines, east, 30);
  const auto& shared = of_west[2].all();
  ASSERT_EQ(shared.size(), of_east[0].all().size());
  ASSERT_FALSE(shared.empty());
  for (std::size_t k = 0; k < shared.size(); ++k) {
    EXPECT_EQ(shared[k].t, of_east[0].all()[k].t);
    EXPECT_EQ(shared[k].height_m, 123.5);  // on the step
  }
  for (const double tolerance : {0.0, 20.0, 120.0}) {
    const auto ends_at = [&](TileId id, auto& sides, double u) {
      std::vector<double> at;
      for (const TileLine& l : tile_lines(lines, id, kAll, sides, tolerance).lines)
        for (const Vec3& p : {l.points.front(), l.points.back()})
          if (p.x == u) at.push_back(p.y);
      std::ranges::sort(at);
      return at;
    };
    const auto left = ends_at(west, of_west, kTileExtent), right = ends_at(east, of_east, 0);
    EXPECT_FALSE(left.empty());
    for (const double v : left)
      EXPECT_TRUE(std::ranges::any_of(shared, [&](const auto& s) { return s.t == v; })) << v;
    for (const double v : right)
      EXPECT_TRUE(std::ranges::any_of(shared, [&](const auto& s) { return s.t == v; })) << v;
  }
}

TEST(TileLines, stay_within_the_tolerance_and_get_fewer) {
  const ShapeLines lines = wiggly(1);
  const TileId id{4, 18, 12};
  const auto sides = crossings(lines, id, 1);
  std::size_t before = 1 << 20;
  for (const double tolerance : {0.0, 20.0, 100.0}) {
    const TileLines found = tile_lines(lines, id, kAll, sides, tolerance);
    std::size_t points = 0;
    for (const TileLine& l : found.lines)
      for (const Vec3& p : l.points) {
        ++points;
        EXPECT_EQ(p.x, std::round(p.x));
        EXPECT_EQ(p.z, 123.5);
        EXPECT_TRUE(p.x >= 0 && p.y >= 0 && p.x <= kTileExtent && p.y <= kTileExtent);
      }
    EXPECT_LT(points, before);
    EXPECT_GT(points, 4u);
    before = points;
    // What changed sides is no farther from the line than the tolerance: a strip of its length.
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(0, kTileExtent);
    int between = 0;
    for (int k = 0; k < 20000; ++k)
      between += found.between.holding(place(random), place(random)) != AreaSet::kNone;
    EXPECT_LE(between, tolerance == 0 ? 20 : 1500);
  }
}

TEST(TileLines, what_is_too_small_for_a_level_is_left_out) {
  const ShapeLines lines({wiggly(0.01).chains()}, {{0.02, 40}});
  LineScale scale = kAll;
  scale.least_deg = 0.05, scale.relief_m = 100;
  EXPECT_TRUE(lines.pieces(tiling::rect({4, 18, 12}), scale).empty());
  scale.relief_m = 30;  // an island that matters
  EXPECT_FALSE(lines.pieces(tiling::rect({4, 18, 12}), scale).empty());
  scale.finest_deg = 0.03;  // but that the grid cannot hold
  EXPECT_TRUE(lines.pieces(tiling::rect({4, 18, 12}), scale).empty());
}

TEST(TileLines, a_line_along_an_edge_lies_beside_it) {
  // Along 22.5 degrees east, where tiles of all levels meet; half a step of the lattice beside it.
  ShapeChain chain;
  chain.level_m = 7;
  chain.points = {{22.5 + 1e-11, 46, 0},
                  {22.5 + 1e-11, 50, 0},
                  {25, 50, 0},
                  {25, 46, 0},
                  {22.5 + 1e-11, 46, 0}};
  const ShapeLines lines({chain}, {{4, 0}});
  const TileId east{4, 18, 12}, west{4, 17, 12};
  const auto found = tile_lines(lines, east, kAll, crossings(lines, east, 1), 0);
  ASSERT_EQ(found.lines.size(), 1u);
  EXPECT_TRUE(found.lines[0].closed);
  for (const Vec3& p : found.lines[0].points) EXPECT_GE(p.x, 1);
  EXPECT_TRUE(tile_lines(lines, west, kAll, crossings(lines, west, 1), 0).lines.empty());
}

TEST(ShoreBender, leads_a_shore_past_posts_that_are_as_good_as_on_it) {
  TileLines lines;
  lines.lines.push_back({{{1000, 1000, 5}, {9000, 1000, 5}}, true, false, 0});
  lines.level_between = {5};
  const auto wet = [](double, double v) { return v < 1000; };
  ShoreBender bender(lines);
  bender.meet({5000, 1001, 50}, 10);   // dry, a unit from the shore
  bender.meet({6000, 1002, 7}, 10);    // no matter
  bender.meet({7000, 1040, 500}, 10);  // far enough
  bender.bend(lines, wet);
  ASSERT_EQ(lines.lines[0].points.size(), 3u);
  EXPECT_EQ(lines.lines[0].points[1], (Vec3{5000, 997, 5}));
}

}  // namespace
}  // namespace tind
