#include "terrain/mesh/halfedge_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

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

/// A grid with some of its edges collapsed.
HalfedgeMesh worn_grid(int side, std::mt19937& random) {
  HalfedgeMesh m = flat_grid(side, side);
  for (int step = 0; step < 4 * side; ++step) {
    const Index h = Index(random() % m.halfedge_slots());
    if (m.alive_triangle(h / 3) && m.link_ok(h)) m.collapse(h);
  }
  return m;
}

/// The triangles with a corner at v, each from v on, as the plain arrays have them.
std::set<Triangle> triangles_at(const HalfedgeMesh& m, Index v) {
  std::set<Triangle> out;
  for (Index h = 0; h < m.halfedge_slots(); ++h)
    if (m.alive_triangle(h / 3) && m.origin(h) == v) out.insert({v, m.dest(h), m.apex(h)});
  return out;
}

TEST(HalfedgeMesh, NeighboursAreTheOtherCornersOnceEachAndInOrder) {
  std::mt19937 random(3);
  for (int round = 0; round < 30; ++round) {
    const HalfedgeMesh m = worn_grid(6, random);
    for (Index v = 0; v < m.vertex_slots(); ++v) {
      if (!m.alive_vertex(v)) continue;
      const std::set<Triangle> around = triangles_at(m, v);
      std::vector<Index> ring;
      m.for_each_neighbour(v, [&](Index w) { ring.push_back(w); });
      std::set<Index> corners;
      for (const Triangle& t : around) corners.insert({t[1], t[2]});
      EXPECT_EQ(std::set<Index>(ring.begin(), ring.end()), corners);
      EXPECT_EQ(ring.size(), corners.size());
      EXPECT_EQ(int(ring.size()), m.degree(v));
      for (std::size_t i = 0; i + 1 < ring.size(); ++i)
        EXPECT_TRUE(around.contains({v, ring[i], ring[i + 1]}));
      if (!m.on_border(v)) continue;
      EXPECT_EQ(ring.front(), m.dest(m.out(v)));
      EXPECT_EQ(ring.back(), m.origin(m.border_in(v)));
    }
  }
}

TEST(HalfedgeMesh, BorderInArrivesAtItsVertexAlongTheBorder) {
  std::mt19937 random(4);
  for (int round = 0; round < 30; ++round) {
    const HalfedgeMesh m = worn_grid(5, random);
    for (Index v = 0; v < m.vertex_slots(); ++v) {
      if (!m.alive_vertex(v) || !m.on_border(v)) continue;
      const Index in = m.border_in(v);
      EXPECT_EQ(m.twin(in), kNone);
      EXPECT_EQ(m.dest(in), v);
      EXPECT_EQ(m.out(m.origin(in)), in) << "the predecessor's way out";
    }
  }
}

TEST(HalfedgeMesh, FindsTheHalfEdgesThatThereAreAndNoOthers) {
  std::mt19937 random(5);
  const HalfedgeMesh m = worn_grid(6, random);
  for (Index a = 0; a < m.vertex_slots(); ++a) {
    for (Index b = 0; b < m.vertex_slots(); ++b) {
      if (a == b || !m.alive_vertex(a) || !m.alive_vertex(b)) continue;
      Index expected = kNone, back = kNone;
      for (Index h = 0; h < m.halfedge_slots(); ++h) {
        if (!m.alive_triangle(h / 3)) continue;
        if (m.origin(h) == a && m.dest(h) == b) expected = h;
        if (m.origin(h) == b && m.dest(h) == a) back = h;
      }
      EXPECT_EQ(m.find(a, b), expected);
      EXPECT_EQ(m.find_edge(a, b), expected != kNone ? expected : back);
    }
  }
}

TEST(HalfedgeMesh, TheKeptFanIsWhatTheCollapseLeaves) {
  std::mt19937 random(6);
  for (int round = 0; round < 200; ++round) {
    HalfedgeMesh m = worn_grid(5, random);
    const Index h = Index(random() % m.halfedge_slots());
    if (!m.alive_triangle(h / 3) || !m.link_ok(h)) continue;
    const Index gone = m.origin(h), kept = m.dest(h);
    std::vector<Index> ends;
    std::set<Triangle> expected;
    m.for_each_kept(h, [&](Index e) {
      ends.push_back(m.origin(e));
      expected.insert({kept, m.dest(e), m.apex(e)});
    });
    EXPECT_TRUE(std::ranges::is_sorted(ends, {}, [&](Index v) { return v == kept; }))
        << "origin(h) first";
    std::size_t around_gone = 0;
    EXPECT_TRUE(m.all_kept(gone, h, [&](Index e) { return ++around_gone, m.origin(e) == gone; }));
    EXPECT_EQ(around_gone, std::size_t(std::ranges::count(ends, gone)));
    std::size_t seen = 0;
    if (!ends.empty()) {
      EXPECT_FALSE(m.all_kept(h, [&](Index) { return ++seen, false; }));
      EXPECT_EQ(seen, 1u) << "it stops where it is told to";
    }
    m.collapse(h);
    EXPECT_EQ(triangles_at(m, kept), expected);
  }
}

}  // namespace
}  // namespace tind
