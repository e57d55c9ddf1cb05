#include "terrain/simplify/common/terrain_mesh.h"

#include <gtest/gtest.h>

#include <random>

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::grid_from;

TEST(TerrainMesh, WithoutVoidsItIsTheFullGrid) {
  const TerrainMesh t = *terrain_mesh({grid_from("1 2 3 / 4 5 6 / 7 8 9"), 10, 20});
  EXPECT_EQ(t.mesh.triangle_count(), 8u);
  EXPECT_EQ(t.kind[4], VertexKind::interior);
  EXPECT_EQ(t.kind[1], VertexKind::along_x);
  EXPECT_EQ(t.kind[3], VertexKind::along_y);
  EXPECT_EQ(t.kind[0], VertexKind::fixed);
  EXPECT_EQ(t.metric(t.mesh.position(5)), (Vec3{20, -20, 6}));
}

TEST(TerrainMesh, VerticesAtVoidsAreFixed) {
  const TerrainMesh t =
      *terrain_mesh({grid_from("1 1 1 1 1 / 1 1 1 1 1 / 1 1 . 1 1 / 1 1 1 1 1 / 1 1 1 1 1"), 1, 1});
  EXPECT_EQ(t.mesh.check(), "");
  // The void's four neighbours and the two at the cut corners of its cells; the other two corner
  // cells are split along the void's own diagonal.
  int fixed = 0;
  for (std::uint32_t v = 0; v < t.mesh.vertex_slots(); ++v)
    fixed += t.mesh.alive_vertex(v) && t.kind[v] == VertexKind::fixed;
  EXPECT_EQ(fixed, 4 + 4);
  EXPECT_FALSE(t.mesh.alive_vertex(12));
}

TEST(TerrainMesh, SplitsPostsWhereTwoFansMeet) {
  const TerrainMesh t = *terrain_mesh({grid_from("1 1 . / 1 1 . / . . 1"), 1, 1});
  EXPECT_EQ(t.mesh.triangle_count(), 2u);
  const TerrainMesh two = *terrain_mesh({grid_from(". 1 1 1 / . 1 1 1 / 1 1 . . / 1 1 . ."), 1, 1});
  EXPECT_EQ(two.mesh.check(), "");
  EXPECT_TRUE(check_validity(two.mesh.to_tin()).ok());
}

TEST(TerrainMesh, RandomVoidsGiveValidMeshesThatHitEveryPost) {
  std::mt19937 random(4);
  for (int round = 0; round < 300; ++round) {
    HeightGrid grid = test::rough_terrain(2 + int(random() % 9), 2 + int(random() % 9), round);
    const unsigned share = 1 + unsigned(random() % 4);
    for (float& z : grid.values())
      if (random() % 5 < share) z = HeightGrid::kVoid;
    const Result<TerrainMesh> t = terrain_mesh({grid, 30, 30});
    if (!t) {
      EXPECT_EQ(t.error().code, Errc::bad_data);
      continue;
    }
    ASSERT_EQ(t->mesh.check(), "");
    const Tin tin = t->mesh.to_tin();
    EXPECT_TRUE(check_validity(tin).ok()) << check_validity(tin).first_problem;
    EXPECT_EQ(vertical_error(tin, grid).max_m, 0);
  }
}

TEST(TerrainMesh, RefusesWhatHasNoTriangle) {
  EXPECT_EQ(terrain_mesh({HeightGrid(5, 1, 0), 1, 1}).error().code, Errc::bad_data);
  EXPECT_EQ(terrain_mesh({HeightGrid(1, 9, 0), 1, 1}).error().code, Errc::bad_data);
  EXPECT_EQ(terrain_mesh({HeightGrid(5, 5), 1, 1}).error().code, Errc::bad_data);
  EXPECT_EQ(terrain_mesh({grid_from("1 . / . 1"), 1, 1}).error().code, Errc::bad_data);
}

}  // namespace
}  // namespace tind
