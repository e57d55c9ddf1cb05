// Voids kept by methods that cover them, and covered for methods that keep them.

#include "terrain/simplify/constraints/voids.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/common/terrain_mesh.h"
#include "terrain/simplify/constraints/constraints.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/support.h"

namespace tind {
namespace {

double twice_area(const Tin& tin) {
  double sum = 0;
  for (const auto& [a, b, c] : tin.triangles)
    sum += orient2d(tin.vertices[a], tin.vertices[b], tin.vertices[c]);
  return sum;
}

std::vector<MethodOptions> methods_that(const std::string& word) {
  std::vector<MethodOptions> some;
  for (std::size_t i = 0; i < methods().size(); ++i)
    if (methods()[i].voids_alone == word) some.push_back(all_methods()[i]);
  return some;
}

TEST(Voids, RimsAreLinesAlongTheOutermostTriangles) {
  EXPECT_TRUE(void_rims(test::grid_from("1 2 3 / 4 5 6 / 7 8 9")).empty());
  const auto rims = void_rims(test::grid_from("1 2 3 4 / 5 . 6 7 / 8 9 1 2 / 3 4 5 6"));
  // The four cells around the void are triangles: a diamond.
  double length = 0;
  for (const VectorLine& rim : rims) {
    ASSERT_EQ(rim.size(), 2u);
    length += std::hypot(rim[1].x - rim[0].x, rim[1].y - rim[0].y);
    EXPECT_TRUE(std::isnan(rim[0].z));
  }
  EXPECT_NEAR(length, 4 * std::sqrt(2), 1e-12);
  EXPECT_TRUE(void_rims(test::grid_from(". . . / . . . / . . .")).empty());
}

TEST(Voids, KeptByMethodsThatCoverThem) {
  std::vector<MethodOptions> some = methods_that("covered");
  for (const MethodOptions& narrow : methods_that("narrow")) some.push_back(narrow);
  ASSERT_EQ(some.size(), 3u);
  for (const MethodOptions& method : some) {
    std::mt19937 random(5);
    int looked_at = 0;
    for (int round = 0; round < 12; ++round) {
      HeightGrid grid = test::rough_terrain(24, 20, unsigned(round), 60);
      for (int k = 0; k < 1 + round; ++k) {
        const int side = 1 + int(random() % 4), c = int(random() % 24), r = int(random() % 20);
        for (int i = c; i < std::min(24, c + side); ++i)
          for (int j = r; j < std::min(20, r + side); ++j) grid.at(i, j) = HeightGrid::kVoid;
      }
      const Terrain dem{covered(grid), 10, 10};
      const auto full = terrain_mesh({grid, 10, 10});
      ASSERT_TRUE(full);
      const double area = twice_area(full->mesh.to_tin());
      SimplifyOptions options;
      options.method = method;
      options.stop.max_error_m = 4;
      auto lines = constrain(dem, {.breaklines = void_rims(grid), .flatten = {}, .boundary = {}});
      ASSERT_TRUE(lines) << lines.error().what;
      options.constraints = std::make_shared<const Constraints>(std::move(*lines));
      auto made = simplify(dem, options);
      ASSERT_TRUE(made) << method_name(method) << " " << round << ": " << made.error().what;
      open_voids(made->tin, grid);
      EXPECT_NEAR(twice_area(made->tin), area, 1e-6) << method_name(method) << " " << round;
      const VerticalError error = vertical_error(made->tin, grid);
      EXPECT_LE(error.max_m, 4 + 1e-6) << method_name(method) << " " << round;
      looked_at += area > 0;
    }
    EXPECT_EQ(looked_at, 12);
  }
}

TEST(Voids, CoveredForMethodsThatKeepThem) {
  std::vector<MethodOptions> some = methods_that("holes");
  for (const MethodOptions& narrow : methods_that("narrow")) some.push_back(narrow);
  ASSERT_EQ(some.size(), 7u);
  for (const MethodOptions& method : some) {
    HeightGrid grid = test::rough_terrain(30, 24, 3, 60);
    for (int i = 8; i < 19; ++i)
      for (int j = 0; j < 12; ++j) grid.at(i, j) = HeightGrid::kVoid;
    SimplifyOptions options;
    options.method = method;
    options.stop.max_error_m = 3;
    const auto made = simplify({covered(grid), 10, 10}, options);
    ASSERT_TRUE(made) << made.error().what;
    EXPECT_NEAR(twice_area(made->tin), 2 * 29 * 23, 1e-6) << method_name(method);
    EXPECT_LE(vertical_error(made->tin, grid).max_m, 3 + 1e-6) << method_name(method);
  }
}

TEST(Voids, NoMethodMakesAMeshWithoutATriangle) {
  HeightGrid far = test::rough_terrain(60, 60, 3, 60);
  for (int r = 0; r < 60; ++r)
    for (int c = 0; c < 60; ++c)
      if ((r + 60 * c) % 1201 != 0) far.at(c, r) = HeightGrid::kVoid;
  for (const HeightGrid& grid : {test::grid_from("1 . . . / . 2 . . / . . 3 . / . . . 4"),
                                 test::grid_from(". . . / . . . / . . ."), far})
    for (const MethodOptions& method : all_methods()) {
      SimplifyOptions options;
      options.method = method;
      options.stop.ratio = 0.5;
      const auto made = simplify({grid, 10, 10}, options);
      if (made)
        EXPECT_GT(made->tin.triangles.size(), 0u) << method_name(method);
      else
        EXPECT_EQ(made.error().code, Errc::bad_data) << method_name(method) << made.error().what;
    }
}

TEST(Voids, CoveringIsSmoothAndMovesNoPost) {
  HeightGrid grid =
      test::grid_from("0 0 0 0 0 9 / 0 . . . . 9 / 0 . . . . 9 / 0 . . . . 9 / 0 0 0 0 0 9");
  const HeightGrid filled = covered(grid);
  EXPECT_FALSE(has_voids(filled));
  for (int r = 0; r < grid.rows(); ++r)
    for (int c = 0; c < grid.cols(); ++c) {
      if (!grid.is_void(c, r)) {
        EXPECT_EQ(filled.at(c, r), grid.at(c, r));
      }
      EXPECT_GE(filled.at(c, r), 0);
      EXPECT_LE(filled.at(c, r), 9);
      if (c > 1 && r > 0 && r < 4) {
        EXPECT_GE(filled.at(c, r), filled.at(c - 1, r)) << c << " " << r;
      }
    }
  EXPECT_TRUE(has_voids(covered(test::grid_from(". . / . ."))));
  EXPECT_EQ(covered(test::grid_from(". . . / . 7 .")).at(2, 0), 7);
  EXPECT_EQ(covered(test::grid_from("1 2 / 3 4")).at(1, 0), 2);
}

}  // namespace
}  // namespace tind
