#include "terrain/mesh/manifold.h"

#include <gtest/gtest.h>

#include <random>

#include "terrain/mesh/halfedge_mesh.h"

namespace tind {
namespace {

TEST(MakeManifold, LeavesAManifoldAlone) {
  Tin tin;
  tin.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  tin.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_FALSE(make_manifold(tin).changed());
  EXPECT_EQ(tin.vertices.size(), 4u);
}

TEST(MakeManifold, GivesEachFanOfABowTieItsOwnVertexWithItsAttributes) {
  Tin tin;
  tin.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
  tin.triangles = {{0, 1, 2}, {0, 3, 4}};
  tin.colours = {{1, 0, 0}, {}, {}, {}, {}};
  EXPECT_EQ(make_manifold(tin).split_vertices, 1u);
  EXPECT_EQ(tin.vertices[5], tin.vertices[0]);
  EXPECT_EQ(tin.colours[5], tin.colours[0]);
  EXPECT_EQ(tin.triangles[1], (Triangle{5, 3, 4}));
}

TEST(MakeManifold, OpensAnEdgeWithThreeTriangles) {
  Tin tin;
  tin.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  tin.triangles = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  EXPECT_TRUE(make_manifold(tin).changed());
  EXPECT_TRUE(HalfedgeMesh::from_tin(tin));
  EXPECT_EQ(tin.triangles.size(), 3u);
}

TEST(MakeManifold, MakesAnySoupEditable) {
  std::mt19937 random(2);
  for (int round = 0; round < 500; ++round) {
    Tin tin;
    const unsigned n = 3 + random() % 12;
    tin.vertices.resize(n);
    for (unsigned i = 0; i < n; ++i) tin.vertices[i].x = i;
    for (unsigned t = random() % 40; t > 0; --t) {
      tin.triangles.push_back(
          {unsigned(random() % (n + 1)), unsigned(random() % n), unsigned(random() % n)});
    }
    make_manifold(tin);
    const auto mesh = HalfedgeMesh::from_tin(tin);
    ASSERT_TRUE(mesh) << mesh.error().what;
    EXPECT_EQ(mesh->check(), "");
  }
}

TEST(Weld, JoinsEqualVerticesUnlessTheirAttributesDiffer) {
  Tin tin;
  tin.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  tin.triangles = {{0, 1, 2}, {3, 4, 5}};
  Tin coloured = tin;
  coloured.colours = {{}, {}, {}, {1, 0, 0}, {}, {}};
  EXPECT_EQ(weld(tin), 2u);
  EXPECT_EQ(tin.triangles[1], (Triangle{1, 3, 2}));
  EXPECT_EQ(weld(coloured), 1u);
  EXPECT_EQ(coloured.colours.size(), 5u);
}

}  // namespace
}  // namespace tind
