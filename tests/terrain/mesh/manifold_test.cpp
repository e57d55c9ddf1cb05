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

TEST(SplitFans, NumbersCopiesInTheOrderThatIsAskedFor) {
  Tin tin;
  tin.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}};
  // Three triangles at the edge 0-1 join nothing; the second and the last share 0-4.
  tin.triangles = {{0, 1, 2}, {1, 4, 0}, {1, 3, 0}, {0, 4, 5}};
  Tin by_vertex = tin;
  EXPECT_EQ(split_fans(by_vertex, CopyOrder::of_vertices),
            (std::vector<std::uint32_t>{0, 0, 1, 1}));
  EXPECT_EQ(by_vertex.triangles,
            (std::vector<Triangle>{{0, 1, 2}, {8, 4, 6}, {9, 3, 7}, {6, 4, 5}}));
  EXPECT_EQ(split_fans(tin, CopyOrder::of_corners), (std::vector<std::uint32_t>{1, 0, 1, 0}));
  EXPECT_EQ(tin.triangles, (std::vector<Triangle>{{0, 1, 2}, {6, 4, 7}, {8, 3, 9}, {7, 4, 5}}));
  EXPECT_EQ(tin.vertices[6], tin.vertices[1]);
  EXPECT_EQ(tin.vertices[7], tin.vertices[0]);
}

TEST(MakeManifold, SaysWhichVertexEachCopyIsOf) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    Tin tin;
    tin.vertices.resize(8);
    for (unsigned i = 0; i < 8; ++i) tin.vertices[i].x = i;
    for (int t = 0; t < 14; ++t)
      tin.triangles.push_back(
          {unsigned(random() % 8), unsigned(random() % 8), unsigned(random() % 8)});
    const ManifoldRepair repair = make_manifold(tin);
    ASSERT_EQ(tin.vertices.size(), 8 + repair.copy_of.size());
    EXPECT_EQ(repair.split_vertices, repair.copy_of.size());
    for (std::size_t i = 0; i < repair.copy_of.size(); ++i)
      EXPECT_EQ(tin.vertices[8 + i].x, repair.copy_of[i]);
  }
}

TEST(MakeManifold, OpensAnEdgeWithThreeTriangles) {
  Tin tin;
  tin.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  tin.triangles = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  EXPECT_TRUE(make_manifold(tin).changed());
  EXPECT_TRUE(HalfedgeMesh::from_tin(tin));
  EXPECT_EQ(tin.triangles.size(), 3u);
}

TEST(MakeManifold, KeepsOneOfEqualTriangles) {
  Tin tin;
  tin.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  tin.triangles = {{0, 1, 2}, {1, 3, 2}, {1, 2, 0}, {2, 0, 1}, {3, 2, 1}};
  const ManifoldRepair repair = make_manifold(tin);
  EXPECT_EQ(repair.dropped_triangles, 3u);
  EXPECT_EQ(repair.split_vertices, 0u);
  EXPECT_EQ(tin.triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
  // The other side of a triangle is another triangle.
  tin.triangles = {{0, 1, 2}, {0, 2, 1}};
  EXPECT_EQ(make_manifold(tin).dropped_triangles, 0u);
}

TEST(SplitFans, GivesEachOfVeryManyFansItsVertex) {
  Tin tin;  // that meet in the first vertex
  constexpr std::uint32_t kFans = 200'000;
  tin.vertices.resize(2 * kFans + 1);
  for (std::uint32_t i = 0; i < kFans; ++i) tin.triangles.push_back({0, 2 * i + 1, 2 * i + 2});
  EXPECT_EQ(split_fans(tin, CopyOrder::of_vertices), std::vector<std::uint32_t>(kFans - 1, 0));
  for (std::uint32_t i = 1; i < kFans; ++i) ASSERT_EQ(tin.triangles[i][0], 2 * kFans + i);
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
