#include "terrain/mesh/halfedge_mesh.h"

#include <gtest/gtest.h>

#include <random>

#include "terrain/mesh/validity.h"

namespace tind {
namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;

HalfedgeMesh flat_grid(int cols, int rows) {
  std::vector<Vec3> positions;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < cols; ++c) positions.push_back({double(c), -double(r), 0});
  return HalfedgeMesh::from_grid(cols, rows, std::move(positions));
}

TEST(HalfedgeMesh, GridEqualsTheSameTrianglesGivenOneByOne) {
  const HalfedgeMesh grid = flat_grid(5, 4);
  EXPECT_EQ(grid.check(), "");
  EXPECT_EQ(grid.triangle_count(), 24u);
  const Result<HalfedgeMesh> again = HalfedgeMesh::from_tin(grid.to_tin());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->check(), "");
  for (Index h = 0; h < grid.halfedge_slots(); ++h) {
    EXPECT_EQ(grid.origin(h), again->origin(h));
    EXPECT_EQ(grid.twin(h), again->twin(h));
  }
  for (Index v = 0; v < grid.vertex_slots(); ++v) {
    EXPECT_EQ(grid.on_border(v), again->on_border(v));
    EXPECT_EQ(grid.degree(v), again->degree(v));
  }
}

TEST(HalfedgeMesh, RefusesWhatIsNotAManifold) {
  const std::vector<Vec3> corners(5);
  EXPECT_FALSE(HalfedgeMesh::from_tin({corners, {{0, 1, 7}}, {}, {}, {}}));
  EXPECT_FALSE(HalfedgeMesh::from_tin({corners, {{0, 1, 1}}, {}, {}, {}}));
  EXPECT_FALSE(HalfedgeMesh::from_tin({corners, {{0, 1, 2}, {0, 1, 3}}, {}, {}, {}}));
  EXPECT_FALSE(HalfedgeMesh::from_tin({corners, {{0, 1, 2}, {0, 3, 4}}, {}, {}, {}}));
  EXPECT_TRUE(HalfedgeMesh::from_tin({corners, {{0, 1, 2}, {0, 2, 3}}, {}, {}, {}}));
}

/// Euler's formula for a disk: vertices - edges + triangles = 1.
void expect_a_disk(const HalfedgeMesh& m) {
  std::size_t vertices = 0, edges = 0;
  for (Index v = 0; v < m.vertex_slots(); ++v) vertices += m.alive_vertex(v);
  for (Index h = 0; h < m.halfedge_slots(); ++h)
    edges += m.alive_triangle(h / 3) && (m.twin(h) == kNone || h < m.twin(h));
  EXPECT_EQ(vertices + m.triangle_count(), edges + 1);
}

TEST(HalfedgeMesh, RandomCollapsesKeepEveryInvariant) {
  std::mt19937 random(1);
  for (int round = 0; round < 60; ++round) {
    HalfedgeMesh m = flat_grid(2 + int(random() % 7), 2 + int(random() % 7));
    for (int step = 0; step < 400; ++step) {
      const Index h = Index(random() % m.halfedge_slots());
      if (!m.alive_triangle(h / 3) || !m.link_ok(h)) continue;
      const std::size_t before = m.triangle_count();
      const bool border = m.twin(h) == kNone;
      const Index kept = m.dest(h), gone = m.origin(h);
      ASSERT_EQ(m.collapse(h), kept);
      EXPECT_FALSE(m.alive_vertex(gone));
      EXPECT_EQ(m.triangle_count(), before - (border ? 1 : 2));
      ASSERT_EQ(m.check(), "") << "round " << round << " step " << step;
    }
    expect_a_disk(m);
  }
}

TEST(HalfedgeMesh, RandomEditsKeepEveryInvariant) {
  std::mt19937 random(2);
  for (int round = 0; round < 40; ++round) {
    HalfedgeMesh m = flat_grid(2 + int(random() % 5), 2 + int(random() % 5));
    for (int step = 0; step < 300; ++step) {
      const Index h = Index(random() % m.halfedge_slots());
      if (!m.alive_triangle(h / 3)) continue;
      const Index a = m.origin(h), b = m.dest(h), c = m.apex(h), g = m.twin(h);
      switch (random() % 4) {
        case 0: {
          const Index v = m.split_triangle(h / 3, {});
          EXPECT_EQ(m.degree(v), 3);
          break;
        }
        case 1: {
          const Index v = m.split_edge(h, {});
          EXPECT_EQ(m.degree(v), g == kNone ? 3 : 4);
          break;
        }
        case 2: {
          if (g == kNone) break;
          const Index d = m.apex(g);
          bool joined = false;  // a flip must not make an edge that is there already
          m.for_each_out(c, [&](Index e) { joined |= m.dest(e) == d || m.apex(e) == d; });
          if (joined) break;
          m.flip(h);
          EXPECT_EQ(m.origin(h), d);
          EXPECT_EQ(m.dest(h), c);
          break;
        }
        default:
          if (m.link_ok(h)) m.collapse(h);
      }
      ASSERT_EQ(m.check(), "") << "round " << round << " step " << step << " edge " << a << "-"
                               << b;
    }
    expect_a_disk(m);
  }
}

TEST(HalfedgeMesh, LinkConditionRefusesChordsAndSeparatingTriangles) {
  HalfedgeMesh m = flat_grid(2, 2);
  for (Index h = 0; h < 6; ++h)
    if (m.twin(h) != kNone) {
      EXPECT_FALSE(m.link_ok(h)) << "the diagonal joins two border vertices";
    }
  // A vertex of degree 3 inside 0-1-2: the edges of its hull now share a neighbour that is no apex.
  Tin tin;
  tin.vertices = {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}, {2, 2, 0}, {9, 9, 0}};
  tin.triangles = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {1, 4, 2}};
  HalfedgeMesh n = *HalfedgeMesh::from_tin(tin);
  for (Index h = 0; h < n.halfedge_slots(); ++h)
    if (n.origin(h) == 1 && n.dest(h) == 2) {
      EXPECT_FALSE(n.link_ok(h));
    }
}

TEST(HalfedgeMesh, ToTinLeavesOutWhatIsRemoved) {
  HalfedgeMesh m = flat_grid(4, 4);
  for (Index h = 0; h < m.halfedge_slots(); ++h) {
    if (m.origin(h) != 5 || m.dest(h) != 6) continue;
    ASSERT_TRUE(m.link_ok(h));
    m.collapse(h);
    break;
  }
  std::vector<Index> index;
  const Tin tin = m.to_tin(&index);
  EXPECT_EQ(tin.triangles.size(), 16u);
  EXPECT_EQ(tin.vertices.size(), 15u);
  EXPECT_EQ(index[5], kNone);
  EXPECT_EQ(index[6], 5u);
  EXPECT_TRUE(check_validity(tin).ok()) << check_validity(tin).first_problem;
}

}  // namespace
}  // namespace tind
