// The checker's search for the triangle under a place, against a look at every triangle.

#include "terrain/check/check_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "terrain/mesh/tin.h"

namespace tind {
namespace {

constexpr int kEnd = 32767;

void add_vertex(CheckedTile& tile, int u, int v, int h) {
  tile.u.push_back(u), tile.v.push_back(v), tile.h.push_back(h);
}

/// Two triangles over all of the tile, then `splits` of one into three, at places near `towards`.
CheckedTile split_again_and_again(int splits, Vec2 towards, double spread, unsigned seed) {
  CheckedTile tile;
  tile.max_height = 1000;
  std::mt19937 random(seed);
  std::normal_distribution<double> near(0, spread);
  for (const auto& [u, v] : {std::pair{0, 0}, {kEnd, 0}, {kEnd, kEnd}, {0, kEnd}})
    add_vertex(tile, u, v, int(random() % 32768));
  tile.triangles = {{0, 1, 2}, {0, 2, 3}};
  const auto place = [&](std::uint32_t i) { return Vec3{double(tile.u[i]), double(tile.v[i]), 0}; };
  for (int k = 0; k < splits; ++k) {
    const Vec3 p{std::round(towards.x + near(random)), std::round(towards.y + near(random)), 0};
    for (auto& t : tile.triangles) {
      const auto [a, b, c] = t;
      if (orient2d(place(a), place(b), p) <= 0 || orient2d(place(b), place(c), p) <= 0 ||
          orient2d(place(c), place(a), p) <= 0)
        continue;
      const auto n = std::uint32_t(tile.u.size());
      add_vertex(tile, int(p.x), int(p.y), int(random() % 32768));
      t = {a, b, n};
      tile.triangles.push_back({b, c, n});
      tile.triangles.push_back({c, a, n});
      break;
    }
  }
  return tile;
}

/// A fan of so many triangles around one vertex that no square parts them.
CheckedTile fan(int count, double u, double v, double radius) {
  CheckedTile tile;
  tile.max_height = 1000;
  add_vertex(tile, int(u), int(v), 5);
  for (int k = 0; k < count; ++k) {
    const double angle = 2 * M_PI * k / count;
    add_vertex(tile, int(u + radius * std::cos(angle)), int(v + radius * std::sin(angle)), 100 * k);
    tile.triangles.push_back({0, std::uint32_t(1 + k), std::uint32_t(1 + (k + 1) % count)});
  }
  return tile;
}

/// Of one triangle: what the surface says of a tile that has no other.
std::optional<TileSurface::Gap> alone(const CheckedTile& tile, std::size_t t, Vec2 p) {
  CheckedTile one = tile;
  one.triangles = {tile.triangles[t]};
  return TileSurface(one).gap_at(p.x, p.y, 0);
}

void expect_as_all_triangles_say(const CheckedTile& tile, unsigned seed) {
  const TileSurface surface(tile);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> anywhere(0, kEnd), near(-40, 40);
  std::vector<Vec2> places;
  for (int k = 0; k < 30; ++k) places.push_back({anywhere(random), anywhere(random)});
  for (std::size_t i = 0; i < tile.u.size(); i += 1 + tile.u.size() / 60) {
    const double u = tile.u[i], v = tile.v[i];
    places.push_back({u, v});
    places.push_back({std::clamp(u + near(random), 0.0, double(kEnd)),
                      std::clamp(v + near(random), 0.0, double(kEnd))});
  }
  for (const double half : {kEnd / 2.0, kEnd / 4.0, kEnd / 64.0})  // sides of squares
    for (int k = 0; k < 5; ++k) places.push_back({half, anywhere(random)});
  std::size_t covered = 0;
  for (const Vec2& p : places) {
    const auto got = surface.gap_at(p.x, p.y, 0);
    std::optional<TileSurface::Gap> wanted;
    for (std::size_t t = 0; t < tile.triangles.size(); ++t) {
      const auto one = alone(tile, t, p);
      if (!one) continue;
      if (!wanted) wanted = one;
      wanted->low = std::min(wanted->low, one->low);
      wanted->high = std::max(wanted->high, one->high);
    }
    ASSERT_EQ(got.has_value(), wanted.has_value()) << p.x << ' ' << p.y;
    if (!got) continue;
    ++covered;
    EXPECT_EQ(got->low, wanted->low) << p.x << ' ' << p.y;
    EXPECT_EQ(got->high, wanted->high) << p.x << ' ' << p.y;
  }
  EXPECT_GT(covered, places.size() / 4);
}

TEST(TileSurface, finds_what_a_look_at_every_triangle_finds) {
  expect_as_all_triangles_say(split_again_and_again(0, {0, 0}, 1, 1), 1);
  expect_as_all_triangles_say(split_again_and_again(200, {16000, 16000}, 9000, 2), 2);
  expect_as_all_triangles_say(split_again_and_again(200, {300, 400}, 100, 3), 3);  // in a corner
}

TEST(TileSurface, parts_no_triangles_that_lie_on_one_another) {
  CheckedTile tile = split_again_and_again(0, {0, 0}, 1, 1);
  for (int k = 0; k < 40; ++k) tile.triangles.insert(tile.triangles.end(), {{0, 1, 2}, {0, 2, 3}});
  const TileSurface surface(tile);
  const auto gap = surface.gap_at(100, 200, 0);
  ASSERT_TRUE(gap);
  EXPECT_EQ(gap->low, gap->high);
}

TEST(TileSurface, parts_no_fan_for_ever) {
  expect_as_all_triangles_say(fan(7, 16000, 17000, 12000), 4);
  expect_as_all_triangles_say(fan(90, kEnd / 2, kEnd / 2, 16000), 5);
}

}  // namespace
}  // namespace tind
