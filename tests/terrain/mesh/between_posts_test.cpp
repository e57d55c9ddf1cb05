#include "terrain/mesh/between_posts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "terrain/mesh/triangle_locator.h"
#include "terrain/raster/interpolate.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::grid_from;
using test::rough_terrain;

SurfaceError measured(const Tin& mesh, const HeightGrid& grid, int threads = 1) {
  return surface_error(mesh, grid, vertical_error(mesh, grid), threads);
}

/// Two triangles over a rectangle of posts, on the corners' heights.
Tin two_triangles(const HeightGrid& grid) {
  const int c = grid.cols() - 1, r = grid.rows() - 1;
  Tin mesh;
  mesh.vertices = {{0, 0, grid.at(0, 0)},
                   {double(c), 0, grid.at(c, 0)},
                   {0, -double(r), grid.at(0, r)},
                   {double(c), -double(r), grid.at(c, r)}};
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}};
  return mesh;
}

TEST(BetweenPosts, TheMiddleOfATwistedCellIsAsFarAsTheTwistSays) {
  // Two opposite corners up: the surface is .5 in the middle, the diagonal of the mesh 0 or 1.
  const HeightGrid grid = grid_from("1 0 / 0 1");
  const Tin mesh = two_triangles(grid);
  EXPECT_EQ(vertical_error(mesh, grid).max_m, 0);
  const SurfaceError error = measured(mesh, grid);
  EXPECT_DOUBLE_EQ(error.max_m(), 0.5);
  EXPECT_DOUBLE_EQ(error.max_below_m, 0.5);
  EXPECT_DOUBLE_EQ(error.at.x, 0.5);
  EXPECT_DOUBLE_EQ(error.at.y, 0.5);
}

TEST(BetweenPosts, APlaneIsNowhereOff) {
  const HeightGrid grid = grid_from("0 1 2 3 / 10 11 12 13 / 20 21 22 23");
  EXPECT_NEAR(measured(two_triangles(grid), grid).max_m(), 0, 1e-12);
}

TEST(BetweenPosts, NoPlaceIsFartherThanSaidAndOneIsAsFar) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const int voids : {0, 150}) {
    HeightGrid grid = rough_terrain(65, 57, 3);
    for (int k = 0; k < voids; ++k)
      grid.at(int(unit(random) * 65), int(unit(random) * 57)) = HeightGrid::kVoid;
    for (const bool on_posts : {true, false}) {  // whose vertices are; those of others are anywhere
      SimplifyOptions options;
      if (on_posts)
        options.method = GreedyOptions();
      else
        options.method = EdgeCostOptions();
      options.stop.ratio = 0.08;
      const auto made = simplify({grid, 1, 1}, options);
      ASSERT_TRUE(made) << made.error().what;
      const Tin& mesh = made->tin;
      const SurfaceError error = measured(mesh, grid);
      EXPECT_GE(error.max_m(), vertical_error(mesh, grid).max_m);
      const TriangleLocator triangles(mesh);
      const auto difference = [&](double x, double y) {
        const int c = std::min(int(x), 63), r = std::min(int(y), 55);
        const auto z = triangles.height_at({x, -y});
        return z ? *z - height_between(grid.at(c, r), grid.at(c + 1, r), grid.at(c, r + 1),
                                       grid.at(c + 1, r + 1), x - c, y - r)
                 : std::nan("");
      };
      double above = 0, below = 0;
      for (int k = 0; k < 400'000; ++k) {
        const double d = difference(unit(random) * 64, unit(random) * 56);
        if (d > above) above = d;
        if (-d > below) below = -d;
      }
      EXPECT_LE(above, error.max_above_m + 1e-9) << voids << " voids";
      EXPECT_LE(below, error.max_below_m + 1e-9) << voids << " voids";
      EXPECT_GE(above, 0.9 * error.max_above_m) << "is it there at all?";
      EXPECT_NEAR(std::abs(difference(error.at.x, error.at.y)), error.max_m(), 1e-6);
      const SurfaceError again = measured(mesh, grid, 3);
      EXPECT_EQ(again.max_above_m, error.max_above_m);
      EXPECT_EQ(again.max_below_m, error.max_below_m);
      EXPECT_EQ(again.at.x, error.at.x);
    }
  }
}

TEST(BetweenPosts, WhatIsOutsideThePostsIsNotMeasured) {
  const HeightGrid grid = grid_from("5 5 / 5 5");
  Tin mesh;
  mesh.vertices = {{-10, 10, 5}, {-10, -30, 5}, {30, 10, 5}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_EQ(measured(mesh, grid).max_m(), 0);
  EXPECT_EQ(measured(Tin{}, grid).max_m(), 0);
  EXPECT_EQ(measured(mesh, HeightGrid{}).max_m(), 0);
}

TEST(BetweenPosts, ARowOfPostsIsMeasuredAlongItsLine) {
  const HeightGrid grid = grid_from("0 4 0");
  Tin mesh;
  mesh.vertices = {{0, 0, 0}, {2, -1, 0}, {2, 0, 0}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_DOUBLE_EQ(measured(mesh, grid).max_below_m, 4);
}

}  // namespace
}  // namespace tind
