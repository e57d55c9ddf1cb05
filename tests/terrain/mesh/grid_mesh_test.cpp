#include "terrain/mesh/grid_mesh.h"

#include <gtest/gtest.h>

#include <random>

#include "terrain/mesh/validity.h"
#include "tests/support/support.h"

namespace tind {
namespace {

TEST(GridMesh, SplitsEachCellFromLowerLeftToUpperRight) {
  const auto mesh = grid_mesh(test::grid_from("1 2 / 3 4"));
  ASSERT_TRUE(mesh);
  const Tin tin = mesh->to_tin();
  ASSERT_EQ(tin.triangles.size(), 2u);
  EXPECT_EQ(tin.triangles[0], (Triangle{0, 2, 1}));
  EXPECT_EQ(tin.triangles[1], (Triangle{3, 1, 2}));
  EXPECT_EQ(tin.vertices[3], (Vec3{1, -1, 4}));
}

TEST(GridMesh, LeavesOutTrianglesWithVoidCornersAndUnusedPosts) {
  const auto mesh = grid_mesh(test::grid_from(". 2 / 3 4"));
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->to_tin().triangles.size(), 1u);
  EXPECT_EQ(mesh->to_tin().vertices.size(), 3u);
}

TEST(GridMesh, MakesOneVertexForEachFanWhereVoidsPinch) {
  // Only the post in the middle joins the two corners.
  const auto mesh = grid_mesh(test::grid_from(". 1 1 / 1 1 1 / 1 1 ."));
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->check(), "");
  const auto pinched = grid_mesh(test::grid_from("1 1 . / 1 1 . / . . 1 / . 1 1"));
  ASSERT_TRUE(pinched);
  EXPECT_EQ(pinched->to_tin().triangles.size(), 3u);
  EXPECT_EQ(pinched->check(), "");
}

TEST(GridMesh, IsAManifoldForAnyPatternOfVoids) {
  std::mt19937 random(7);
  for (int round = 0; round < 300; ++round) {
    HeightGrid grid(2 + int(random() % 9), 2 + int(random() % 9), 0);
    for (float& z : grid.values())
      z = random() % 10 < unsigned(round % 8) ? HeightGrid::kVoid : float(random() % 100);
    const auto mesh = grid_mesh(grid);
    if (!mesh) {
      EXPECT_EQ(mesh.error().code, Errc::bad_data);
      EXPECT_EQ(grid_triangle_count(grid), 0u);
      continue;
    }
    ASSERT_EQ(mesh->check(), "");
    const Tin tin = mesh->to_tin();
    const MeshValidity validity = check_validity(tin);
    EXPECT_TRUE(validity.ok()) << validity.first_problem;
    EXPECT_EQ(tin.triangles.size(), grid_triangle_count(grid));
    EXPECT_EQ(validity.area, double(tin.triangles.size()) / 2);
  }
}

TEST(GridMesh, RefusesWhatHasNoCell) {
  EXPECT_EQ(grid_mesh(HeightGrid(5, 1, 0)).error().code, Errc::invalid_argument);
  EXPECT_EQ(grid_mesh(HeightGrid(5, 5)).error().code, Errc::bad_data);
}

}  // namespace
}  // namespace tind
