#include "terrain/analysis/profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "terrain/analysis/grid_walk.h"
#include "terrain/analysis/heights_at.h"
#include "terrain/raster/interpolate.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::MadeUpSource;

/// H at a place in post coordinates.
double height_at_post(const HeightGrid& grid, double x, double y) {
  const int c = int(std::floor(x)), r = int(std::floor(y));
  const auto post = [&](int col, int row) {
    return grid.inside(col, row) ? double(grid.at(col, row)) : double(HeightGrid::kVoid);
  };
  return height_between(post(c, r), post(c + 1, r), post(c, r + 1), post(c + 1, r + 1), x - c,
                        y - r);
}

TEST(GridWalk, PiecesAreTheSurfaceWithVoidsEveryWay) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(-0.4, 1.4);
  for (int round = 0; round < 3000; ++round) {
    const HeightGrid grid = test::terraced_grid(random, 6, 5, 50, 7);
    const double w = grid.cols() - 1, h = grid.rows() - 1;
    Vec2 p{w * anywhere(random), h * anywhere(random)},
        q{w * anywhere(random), h * anywhere(random)};
    if (round % 4 == 0) p = {std::round(p.x), std::round(p.y)};  // through posts,
    if (round % 8 == 0) q.x = p.x;                               // along a column
    double reached = 0;
    walk_grid(
        p, q,
        [&](std::int64_t c, std::int64_t r) {
          return grid.inside(int(c), int(r)) ? double(grid.at(int(c), int(r)))
                                             : double(HeightGrid::kVoid);
        },
        [&](const WalkPiece& piece) {
          EXPECT_EQ(piece.from, reached);
          EXPECT_LT(piece.from, piece.to);
          reached = piece.to;
          for (const double share : {0.2, 0.5, 0.9}) {
            const double t = piece.from + share * (piece.to - piece.from);
            const double truth = height_at_post(grid, p.x + t * (q.x - p.x), p.y + t * (q.y - p.y));
            EXPECT_EQ(piece.is_void, std::isnan(truth)) << round << " " << t;
            if (!piece.is_void && !std::isnan(truth)) {
              EXPECT_NEAR(piece.height.at(t), truth, 1e-7);
            }
          }
          return !::testing::Test::HasFailure();
        });
    ASSERT_FALSE(HasFailure()) << round;
    if (p != q) {
      ASSERT_EQ(reached, 1) << round;
    }
  }
}

TEST(Profile, ExactHasEveryTopAndBottomOfTheLine) {
  std::mt19937 random(3);
  const MadeUpSource dem(test::terrain_with_voids(60, 50, 3), {10, 50}, 0.01);
  std::uniform_real_distribution<double> lon(10.02, 10.57), lat(49.53, 49.98);
  for (int round = 0; round < 40; ++round) {
    const Geographic places[] = {
        {lon(random), lat(random)}, {lon(random), lat(random)}, {lon(random), lat(random)}};
    const GeodesicPath path(places);
    const auto exact = exact_profile(dem, path);
    ASSERT_TRUE(exact) << exact.error().what;
    const auto dense = sampled_profile(dem, path, even_distances(path.length_m(), 4001));
    ASSERT_TRUE(dense);
    ASSERT_EQ(exact->points.front().distance_m, 0);
    ASSERT_NEAR(exact->points.back().distance_m, path.length_m(), 1e-6);
    std::size_t next = 1;
    for (const ProfilePoint& p : dense->points) {
      while (next + 1 < exact->points.size() && exact->points[next].distance_m < p.distance_m)
        ++next;
      const ProfilePoint &a = exact->points[next - 1], &b = exact->points[next];
      ASSERT_LE(a.distance_m, p.distance_m + 1e-6);
      const bool gap = a.height.coverage != Coverage::value || b.height.coverage != Coverage::value;
      if (p.height.coverage != Coverage::value) {
        ASSERT_TRUE(gap || std::min(p.distance_m - a.distance_m, b.distance_m - p.distance_m) < 1)
            << round << " " << p.distance_m;
      } else if (!gap) {
        const auto [low, high] = std::minmax(a.height.height_m, b.height.height_m);
        ASSERT_GE(p.height.height_m, low - 0.1) << round << " " << p.distance_m;
        ASSERT_LE(p.height.height_m, high + 0.1) << round << " " << p.distance_m;
      }
    }
  }
}

TEST(Profile, StepsEndAtTheEnd) {
  EXPECT_EQ(stepped_distances(10, 4), (std::vector<double>{0, 4, 8, 10}));
  EXPECT_EQ(stepped_distances(8, 4), (std::vector<double>{0, 4, 8}));
  EXPECT_EQ(even_distances(8, 3), (std::vector<double>{0, 4, 8}));
}

TEST(Profile, BeyondTheDemIsOutsideAndAVoidIsAVoid) {
  HeightGrid grid(20, 20, 5);
  for (int r = 0; r < 20; ++r) grid.at(10, r) = HeightGrid::kVoid;
  const MadeUpSource dem(grid, {10, 50}, 0.01);
  const Geographic places[] = {{9.9, 49.9}, {10.19, 49.9}};
  const auto profile = exact_profile(dem, GeodesicPath(places));
  ASSERT_TRUE(profile);
  std::string story;
  for (const ProfilePoint& p : profile->points) {
    const char c = p.height.coverage == Coverage::value     ? 'z'
                   : p.height.coverage == Coverage::outside ? 'o'
                                                            : 'v';
    if (story.empty() || story.back() != c) story += c;
  }
  EXPECT_EQ(story, "ozvz");
}

/// What there is in each point, and its height: "z510 o o".
std::string story_of(const DemSource& dem, std::vector<Geographic> places) {
  const auto profile = exact_profile(dem, GeodesicPath(places));
  if (!profile) return profile.error().what;
  std::string story;
  for (const ProfilePoint& p : profile->points) {
    story += story.empty() ? "" : " ";
    if (p.height.coverage == Coverage::value)
      story += "z" + std::to_string(std::lround(p.height.height_m));
    else
      story += p.height.coverage == Coverage::outside ? "o" : "v";
  }
  return story;
}

TEST(Profile, HasTheHeightOfAnEndOnTheRim) {
  HeightGrid grid(5, 4);
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 5; ++c) grid.at(c, r) = float(100 * r + 10 * c);
  const MadeUpSource dem(grid, {10, 50}, 0.01);
  // From the corners outward, from posts and places of the sides; and the same backward.
  struct Row {
    Geographic rim, out;
    int height;
  };
  const Row rows[] = {
      {{10, 50}, {9.99, 50.01}, 0},           {{10.04, 50}, {10.05, 50.01}, 40},
      {{10, 49.97}, {9.99, 49.96}, 300},      {{10.04, 49.97}, {10.05, 49.96}, 340},
      {{10.02, 50}, {10.02, 50.01}, 20},      {{10.015, 49.97}, {10.02, 49.96}, 315},
      {{10.04, 49.985}, {10.06, 49.98}, 190}, {{10, 49.99}, {9.9, 49.99}, 100}};
  for (const Row& row : rows) {
    const std::string z = "z" + std::to_string(row.height);
    EXPECT_EQ(story_of(dem, {row.rim, row.out}), z + " o o") << row.rim.lon << " " << row.rim.lat;
    EXPECT_EQ(story_of(dem, {row.out, row.rim}), "o o " + z) << row.rim.lon << " " << row.rim.lat;
    EXPECT_EQ(story_of(dem, {row.out, row.rim, row.out}), "o o " + z + " o o");
  }
}

TEST(Profile, HasTheHeightOfAnEndOnADemOfOneRowOrColumn) {
  HeightGrid row(4, 1), col(1, 4), one(1, 1, 7);
  for (int k = 0; k < 4; ++k) row.at(k, 0) = col.at(0, k) = float(10 * k);
  EXPECT_EQ(story_of(MadeUpSource(row, {10, 50}, 0.01), {{10.02, 50}, {10.02, 50.01}}), "z20 o o");
  EXPECT_EQ(story_of(MadeUpSource(row, {10, 50}, 0.01), {{10.1, 49.9}, {10.03, 50}}), "o o z30");
  EXPECT_EQ(story_of(MadeUpSource(col, {10, 50}, 0.01), {{10, 49.98}, {10.01, 49.98}}), "z20 o o");
  EXPECT_EQ(story_of(MadeUpSource(one, {10, 50}, 0.01), {{10, 50}, {10.01, 50.01}}), "z7 o o");
}

TEST(Profile, HasTheHeightOfAnEndAtAPostAmongVoids) {
  HeightGrid grid(5, 5);
  grid.at(2, 2) = 42;
  const MadeUpSource dem(grid, {10, 50}, 0.01);
  EXPECT_EQ(story_of(dem, {{10.02, 49.98}, {10.03, 49.975}}), "z42 v v");
  EXPECT_EQ(story_of(dem, {{10.01, 49.985}, {10.02, 49.98}}), "v v z42");
}

TEST(Profile, OfALineThatGoesFarBeyondTheDemIsThatOfItsPart) {
  const MadeUpSource dem(test::rough_terrain(30, 30, 5), {10, 50}, 1e-5);
  const Geographic far[] = {{9, 49.99985}, {60, 49.99985}},
                   near[] = {{9.9999, 49.99985}, {10.0004, 49.99985}};
  const auto all = exact_profile(dem, GeodesicPath(far)),
             part = exact_profile(dem, GeodesicPath(near));
  ASSERT_TRUE(all && part);
  EXPECT_EQ(all->points.front().height.coverage, Coverage::outside);
  EXPECT_EQ(all->points.back().height.coverage, Coverage::outside);
  EXPECT_LE(all->points.size(), part->points.size() + 4);
}

/// The curve's middle lies on its chord, and nothing else of it.
TEST(Profile, ExactFollowsALineThatTurnsInItsMiddle) {
  HeightGrid grid(81, 81);
  for (int r = 0; r < 81; ++r)
    for (int c = 0; c < 81; ++c) grid.at(c, r) = float(100 * (80 - r));
  const MadeUpSource dem(grid, {-40, 40}, 1);
  const Geographic places[] = {{-30, -20}, {30, 20}};
  const auto profile = exact_profile(dem, GeodesicPath(places));
  ASSERT_TRUE(profile);
  for (const ProfilePoint& p : profile->points)
    EXPECT_NEAR(p.height.height_m, 100 * (p.place.lat + 40), 0.02) << p.place.lon;
}

TEST(Profile, OnTheFarSideOfTheGlobeThereIsNoGround) {
  const MadeUpSource region(HeightGrid(21, 21, 777), {-10, 10}, 1);
  for (const auto& [from, to] : {std::pair(Geographic{165, 0}, Geographic{-165, 1}),
                                 std::pair(Geographic{100, 0}, Geographic{-160, 1}),
                                 std::pair(Geographic{170, 80}, Geographic{-5, 80})}) {
    const Geographic places[] = {from, to};
    const auto profile = exact_profile(region, GeodesicPath(places));
    ASSERT_TRUE(profile) << profile.error().what;
    for (const ProfilePoint& p : profile->points)
      EXPECT_EQ(p.height.coverage, Coverage::outside) << p.place.lon << " " << p.place.lat;
  }
  // All of the globe but for ten degrees: on both sides of them there is ground.
  const MadeUpSource most(HeightGrid(351, 21, 777), {-175, 10}, 1);
  const Geographic over[] = {{172, 1}, {-172, 1}};
  const auto profile = exact_profile(most, GeodesicPath(over));
  ASSERT_TRUE(profile) << profile.error().what;
  for (const ProfilePoint& p : profile->points) {
    const bool there = std::abs(p.place.lon)<175 - 1e-6, beyond = std::abs(p.place.lon)> 175 + 1e-6;
    if (there || beyond) {
      EXPECT_EQ(p.height.coverage == Coverage::value, there) << p.place.lon;
    }
  }
  EXPECT_EQ(profile->points.front().height.height_m, 777);
  EXPECT_EQ(profile->points.back().height.height_m, 777);
}

TEST(Profile, AReadErrorIsNoVoid) {
  const MadeUpSource dem(HeightGrid(20, 20, 5), {10, 50}, 0.01);
  dem.reads_left = 0;
  const Geographic places[] = {{10.01, 49.9}, {10.15, 49.9}};
  const auto profile = exact_profile(dem, GeodesicPath(places));
  ASSERT_FALSE(profile);
  EXPECT_EQ(profile.error().code, Errc::io);
}

}  // namespace
}  // namespace tind
