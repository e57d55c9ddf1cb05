// By paper: a pyramid and a plane in UTM zone 33, beside its meridian, where lengths on the ground
// are those of the grid by 0.9996.

#include "terrain/analysis/tin_ground.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "terrain/raster/crs_points.h"
#include "tests/support/support.h"

namespace tind {
namespace {

constexpr double kEast = 500000, kNorth = 5000000, kScale = 0.9996;

/// 400 m a side, 100 m high in its middle.
Tin pyramid() {
  Tin tin;
  for (const Vec3& v : {Vec3{0, 0, 0}, {400, 0, 0}, {400, 400, 0}, {0, 400, 0}, {200, 200, 100}})
    tin.vertices.push_back({kEast + v.x, kNorth + v.y, v.z});
  tin.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  return tin;
}

/// z = x / 10 over 400 m x 200 m.
Tin slope() {
  Tin tin;
  for (const Vec3& v : {Vec3{0, 0, 0}, {400, 0, 40}, {400, 200, 40}, {0, 200, 0}})
    tin.vertices.push_back({kEast + v.x, kNorth + v.y, v.z});
  tin.triangles = {{0, 1, 2}, {0, 2, 3}};
  return tin;
}

TinGround ground_of(Tin tin, const std::string& crs = "EPSG:32633") {
  auto made = tin_ground(std::move(tin), {1, 1, 1}, "hill.ply", crs, {}, {});
  EXPECT_TRUE(made) << made.error().what;
  return std::move(*made);
}

std::vector<Geographic> places(std::vector<Vec2> grid) {
  for (Vec2& p : grid) p = {kEast + p.x, kNorth + p.y};
  const auto crs = CrsPoints::make("EPSG:32633", {15, 45});
  EXPECT_TRUE(crs);
  std::vector<Geographic> out(grid.size());
  (*crs)->to_geographic(grid, out);
  return out;
}

TEST(TinGround, HeightsAreThoseOfTheTriangles) {
  const auto found = heights_at(ground_of(pyramid()),
                                places({{200, 200}, {200, 100}, {50, 200}, {0, 0}, {-1, 200}}));
  ASSERT_TRUE(found);
  const double heights[] = {100, 50, 25, 0};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ((*found)[i].coverage, Coverage::value) << i;
    EXPECT_NEAR((*found)[i].height_m, heights[i], 1e-5) << i;
  }
  EXPECT_EQ((*found)[4].coverage, Coverage::outside);
}

TEST(TinGround, OneOfMostOfTheGlobeIsThereInEast) {
  Tin tin;  // z = longitude + 175
  for (const Vec3& v : {Vec3{-175, -20, 0}, {175, -20, 350}, {175, 20, 350}, {-175, 20, 0}})
    tin.vertices.push_back(v);
  tin.triangles = {{0, 1, 2}, {0, 2, 3}};
  const auto made =
      tin_ground(tin, {111320, 111320, 1}, "world.obj", "EPSG:4326", VerticalDatum::egm96, {});
  ASSERT_TRUE(made) << made.error().what;
  const std::vector<Geographic> asked = {{-174, 1}, {-5, 1}, {0, 1}, {6, 1}, {90, 1}, {174, 1}};
  const auto found = heights_at(*made, asked);
  ASSERT_TRUE(found);
  for (std::size_t i = 0; i < asked.size(); ++i) {
    EXPECT_EQ((*found)[i].coverage, Coverage::value) << asked[i].lon;
    EXPECT_NEAR((*found)[i].height_m, asked[i].lon + 175, 1e-6) << asked[i].lon;
  }
  const std::vector<Geographic> beyond = {{177, 1}};
  EXPECT_EQ(heights_at(*made, beyond)->front().coverage, Coverage::outside);
}

TEST(TinGround, ALineHasAPointAtEachEdge) {
  const TinGround ground = ground_of(pyramid());
  // Up the west face, level along the south face, down the east face.
  const GeodesicPath path(places({{0, 100}, {400, 100}}));
  const auto profile = exact_profile(ground, path);
  ASSERT_TRUE(profile) << profile.error().what;
  ASSERT_EQ(profile->points.size(), 4u);
  const double at[] = {0, 100, 300, 400}, heights[] = {0, 50, 50, 0};
  for (std::size_t i = 0; i < 4; ++i) {
    const ProfilePoint& p = profile->points[i];
    EXPECT_EQ(p.height.coverage, Coverage::value) << i;
    EXPECT_NEAR(p.distance_m, at[i] / kScale, 0.01) << i;
    EXPECT_NEAR(p.height.height_m, heights[i], 0.001) << i;
  }
  // Sampled, it is the same line.
  const auto sampled = sampled_profile(ground, path, even_distances(path.length_m(), 9));
  ASSERT_TRUE(sampled);
  const double samples[] = {0, 25, 50, 50, 50, 50, 50, 25, 0};
  for (std::size_t i = 0; i < 9; ++i)
    EXPECT_NEAR(sampled->points[i].height.height_m, samples[i], 0.001) << i;
}

TEST(TinGround, ALineThatLeavesTheTinSaysSo) {
  const GeodesicPath path(places({{-100, 200}, {500, 200}}));
  const auto profile = exact_profile(ground_of(pyramid()), path);
  ASSERT_TRUE(profile);
  ASSERT_EQ(profile->points.size(), 7u);
  const Coverage covered[] = {Coverage::outside, Coverage::outside, Coverage::value,
                              Coverage::value,   Coverage::value,   Coverage::outside,
                              Coverage::outside};
  for (std::size_t i = 0; i < 7; ++i)
    EXPECT_EQ(profile->points[i].height.coverage, covered[i]) << i;
  EXPECT_NEAR(profile->points[3].height.height_m, 100, 0.001);
  EXPECT_NEAR(profile->points[1].distance_m, 50 / kScale, 0.01);
}

TEST(TinGround, AVolumeIsThatOfTheBody) {
  const double all = 400.0 * 400 * 100 / 3;
  const auto above = [&](double height) { return all * std::pow(1 - height / 100, 3); };
  const TinGround ground = ground_of(pyramid());
  for (const double height : {0.0, 25.0, 50.0, 100.0}) {
    const auto v = volume(ground, LevelReference{height}, 5);
    ASSERT_TRUE(v);
    EXPECT_NEAR(v->area_m2, 160000, 1e-4);
    EXPECT_NEAR(v->cut_m3.value, above(height), 1e-2);
    // Between the ground and the height, less what is under the ground.
    EXPECT_NEAR(v->fill_m3.value, height * 160000 - (all - above(height)), 1e-2);
    EXPECT_NEAR(v->net_m3.value, all - height * 160000, 1e-2);
    EXPECT_NEAR(v->net_m3.high - v->net_m3.low, 2 * 5 * 160000, 1e-2);
    EXPECT_NEAR(v->cut_m3.low, above(std::min(height + 5, 100.0)), 1e-2);
    // Below its foot the body stands on a square.
    const double below = std::max(5 - height, 0.0) * 160000;
    EXPECT_NEAR(v->cut_m3.high, above(std::max(height - 5, 0.0)) + below, 1e-2);
  }
}

TEST(TinGround, AVolumeAgainstAPlaneIsThatOfTwoWedges) {
  // x / 10 against x / 10 + (y - 100) / 20: 5 m to either side, with the y of the north's distance.
  const TinGround ground = ground_of(slope());
  const PlaneReference plane{{{{0, 200, -5}, {400, 200, 35}, {0, 0, 5}}}};
  const auto v = volume(ground, plane);
  ASSERT_TRUE(v);
  EXPECT_NEAR(v->cut_m3.value, 400 * 100 * 5 / 2.0, 1e-2);
  EXPECT_NEAR(v->fill_m3.value, 400 * 100 * 5 / 2.0, 1e-2);
  EXPECT_NEAR(v->net_m3.value, 0, 1e-2);
  EXPECT_FALSE(volume(ground, PlaneReference{{{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}}}));
}

TEST(TinGround, UnitsCount) {
  // Of feet: the same body is smaller by the cube of a foot.
  constexpr double kFoot = 0.3048;
  const auto ground = tin_ground(pyramid(), {kFoot, kFoot, kFoot}, "hill.ply", "", {}, {});
  ASSERT_TRUE(ground);
  const auto v = volume(*ground, LevelReference{0});
  ASSERT_TRUE(v);
  EXPECT_NEAR(v->cut_m3.value, 400.0 * 400 * 100 / 3 * kFoot * kFoot * kFoot, 1e-2);
}

TEST(TinGround, WhatCannotBeAnsweredIsSaid) {
  Tin degrees;
  degrees.vertices = {{15, 45, 0}, {15.1, 45, 0}, {15, 45.1, 10}};
  degrees.triangles = {{0, 1, 2}};
  const TinGround round = ground_of(degrees, "EPSG:4326");
  EXPECT_THAT(volume(round, LevelReference{0}).error().what, testing::HasSubstr("--posts"));
  const TinGround nowhere = ground_of(pyramid(), "");
  EXPECT_TRUE(volume(nowhere, LevelReference{0}));
  EXPECT_THAT(heights_at(nowhere, places({{0, 0}})).error().what, testing::HasSubstr("no CRS"));
  const GeodesicPath path(places({{0, 0}, {1, 1}}));
  EXPECT_FALSE(exact_profile(nowhere, path));
  const auto moved =
      tin_ground(pyramid(), {1, 1, 1}, "hill.ply", "EPSG:32633", VerticalDatum::egm96,
                 {.to_datum = TargetDatum::ellipsoid, .environment = test::environment()});
  EXPECT_THAT(moved.error().what, testing::HasSubstr("--posts"));
}

}  // namespace
}  // namespace tind
