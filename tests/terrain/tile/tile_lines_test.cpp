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

/// Is a place of a tile in a ring?
bool in_ring(const std::vector<Vec3>& ring, double u, double v) {
  bool inside = false;
  for (std::size_t i = 1; i < ring.size(); ++i) {
    const Vec3 &a = ring[i - 1], &b = ring[i];
    if ((a.y <= v) != (b.y <= v)) inside ^= a.x + (v - a.y) / (b.y - a.y) * (b.x - a.x) > u;
  }
  return inside;
}

double distance_to_line(const std::vector<Vec3>& line, double u, double v) {
  double least = HUGE_VAL;
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Vec3 &a = line[i - 1], &b = line[i];
    const double dx = b.x - a.x, dy = b.y - a.y;
    const double t = std::clamp(((u - a.x) * dx + (v - a.y) * dy) / (dx * dx + dy * dy), 0.0, 1.0);
    least = std::min(least, std::hypot(u - a.x - t * dx, v - a.y - t * dy));
  }
  return least;
}

TEST(ShoreBender, leads_a_shore_past_posts_that_are_as_good_as_on_it) {
  for (const bool dry_side : {true, false}) {  // where the rounding of the shore has left the post
    TileLines lines;
    TileLine shore{.points = {{1000, 1000, 5}, {9000, 1000, 5}}, .shore = true};
    shore.between = 0;
    lines.lines.push_back(shore);  // water below, on the right
    lines.level_between = {5};
    ShoreBender bender(lines, 11, 1);
    bender.meet({5000, dry_side ? 1000.4 : 999.6, 50});
    bender.meet({6000, 1000.2, 12});  // within the budget
    bender.meet({7000, 1040, 500});   // far enough, as far as it goes: 2 + 2 * 495 / 11 is more
    bender.meet({8000, 1101, 5000});
    bender.bend(lines);
    const std::vector<Vec3>& line = lines.lines[0].points;
    EXPECT_EQ(line.front(), (Vec3{1000, 1000, 5}));
    EXPECT_EQ(line.back(), (Vec3{9000, 1000, 5}));
    EXPECT_GT(distance_to_line(line, 5000, 1000), 9);
    EXPECT_GT(distance_to_line(line, 7000, 1040), 87);
    EXPECT_LT(distance_to_line(line, 6000, 1000.2), 1);
    EXPECT_LT(distance_to_line(line, 8000, 1101), 102);
    for (const Vec3& p : line) EXPECT_TRUE(p.y <= 1000 && p.z == 5);
    EXPECT_EQ(lines.between.holding(5000, 995), 0u);
    EXPECT_EQ(lines.between.holding(4000, 995), AreaSet::kNone);
    EXPECT_EQ(lines.between.holding(5000, 1005), AreaSet::kNone);
  }
}

TEST(ShoreBender, takes_discs_out_of_any_water_and_nothing_else) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> share(0, 1);
  int moved = 0, flagged = 0;
  for (int round = 0; round < 60; ++round) {
    const bool island = round % 2;
    TileLines lines;
    TileLine shore{.points = {}, .shore = true};
    shore.water_left = !island, shore.closed = true, shore.between = 0;
    const double radius = 200 + 3000 * share(random) * share(random);
    for (int k = 0; k <= 30; ++k) {
      const double a = 2 * M_PI * (k % 30) / 30;
      const double r = k == 30 ? 0 : radius * (0.5 + share(random));
      shore.points.push_back(k == 30 ? shore.points[0]
                                     : Vec3{std::round(16000 + r * std::cos(a)),
                                            std::round(16000 + r * std::sin(a)), 100});
    }
    const std::vector<Vec3> before = shore.points;
    lines.lines.push_back(shore);
    lines.level_between = {100};
    ShoreBender bender(lines, 10, 1);
    std::vector<Vec3> posts;
    for (std::size_t k = 0; k + 1 < before.size(); k += 3) {
      const Vec3 middle = (before[k] + before[k + 1]) * 0.5;
      posts.push_back({middle.x + 6 * share(random) - 3, middle.y + 6 * share(random) - 3,
                       100 + 20 + 150 * share(random)});
      bender.meet(posts.back());
    }
    bender.bend(lines);
    const auto in_shores = [&](double u, double v) {
      return std::ranges::count_if(
                 lines.lines, [&](const TileLine& line) { return in_ring(line.points, u, v); }) %
                 2 ==
             1;
    };
    for (const Vec3& p : posts) {
      const double clear = 0.98 * (2 + 2 * (p.z - 100) / 10);
      ++flagged;
      EXPECT_EQ(in_shores(p.x, p.y), island) << round;
      for (const TileLine& line : lines.lines)
        EXPECT_GT(distance_to_line(line.points, p.x, p.y), clear - 2) << round;
    }
    for (int k = 0; k < 3000; ++k) {
      const double u = 16000 + 2.2 * radius * (share(random) - 0.5),
                   v = 16000 + 2.2 * radius * (share(random) - 0.5);
      double off = HUGE_VAL;  // from the nearest disc's rim
      bool in_disc = false;
      for (const Vec3& p : posts) {
        const double r = 2 + 2 * (p.z - 100) / 10, d = std::hypot(u - p.x, v - p.y);
        in_disc |= d < r;
        off = std::min(off, std::abs(d - r) < 0.1 * r + 3 ? 0 : 1.0);
      }
      if (off == 0 || distance_to_line(before, u, v) < 2) continue;
      const bool was_wet = in_ring(before, u, v) != island;
      EXPECT_EQ(in_shores(u, v) != island, was_wet && !in_disc) << round << " " << u << " " << v;
      moved += was_wet && in_disc;
    }
  }
  EXPECT_GT(moved, 300);
  EXPECT_GT(flagged, 500);
}

}  // namespace
}  // namespace tind
