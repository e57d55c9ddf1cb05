#include "terrain/simplify/collapse/triangle_collapse.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/common/terrain_mesh.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/support.h"

namespace tind {
namespace {

SimplifyOptions options(StopAt stop, Placement placement = Placement::quadric) {
  SimplifyOptions o;
  o.method = TriangleCollapseOptions{placement};
  o.stop = stop;
  return o;
}

/// A sphere of 20 * 4^levels triangles.
Tin sphere(int levels) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  Tin tin;
  tin.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                  {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  tin.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                   {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                   {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                   {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  auto onto = [](Vec3 p) { return p * (1 / length(p)); };
  for (Vec3& v : tin.vertices) v = onto(v);
  for (; levels > 0; --levels) {
    std::map<std::pair<unsigned, unsigned>, unsigned> middle;
    auto half = [&](unsigned a, unsigned b) {
      const auto [at, fresh] = middle.try_emplace(std::minmax(a, b), unsigned(tin.vertices.size()));
      if (fresh) tin.vertices.push_back(onto(tin.vertices[a] + tin.vertices[b]));
      return at->second;
    };
    std::vector<Triangle> next;
    for (const Triangle& t : tin.triangles) {
      const unsigned x = half(t[0], t[1]), y = half(t[1], t[2]), z = half(t[2], t[0]);
      next.insert(next.end(), {{t[0], x, z}, {x, t[1], y}, {z, y, t[2]}, {x, y, z}});
    }
    tin.triangles = std::move(next);
  }
  return tin;
}

TEST(TriangleCollapse, TakesSixTrianglesAStep) {
  const HeightGrid grid = test::rough_terrain(120, 120, 8);
  const auto r = simplify({grid, 30, 30}, options({.ratio = 0.2}));
  ASSERT_TRUE(r);
  const double removed = double(r->input_triangles - r->tin.triangles.size());
  EXPECT_GT(removed / double(r->steps), 5.4);
  EXPECT_LE(removed / double(r->steps), 6);
}

TEST(TriangleCollapse, StaysValidAndCoversEverythingOnAnyGrid) {
  std::mt19937 random(12);
  for (int round = 0; round < 100; ++round) {
    const HeightGrid grid = test::awkward_grid(random, round);
    const auto full = terrain_mesh({grid, 25, 30});
    if (!full) continue;
    const double area = check_validity(full->mesh.to_tin()).area;
    const auto r =
        simplify({grid, 25, 30},
                 options({.ratio = 0.1}, round % 2 ? Placement::quadric : Placement::centroid));
    ASSERT_TRUE(r) << r.error().what;
    const MeshValidity validity = check_validity(r->tin);
    EXPECT_TRUE(validity.ok()) << validity.first_problem;
    EXPECT_NEAR(validity.area, area, 1e-9 * area);
    const double target = std::floor(0.1 * double(r->input_triangles) + 1e-9);
    EXPECT_TRUE(double(r->tin.triangles.size()) <= target || !r->note.empty());
    EXPECT_GE(double(r->tin.triangles.size()), target - 1);
  }
}

TEST(TriangleCollapse, KeepsTheErrorBound) {
  const HeightGrid grid = test::rough_terrain(80, 60, 5);
  const auto r = simplify({grid, 30, 30}, options({.max_error_m = 12}));
  ASSERT_TRUE(r);
  const VerticalError error = vertical_error(r->tin, grid);
  EXPECT_LE(error.max_m, 12);
  EXPECT_EQ(error.uncovered, 0u);
  EXPECT_LT(r->tin.triangles.size(), r->input_triangles / 3);
}

TEST(TriangleCollapse, IsDeterministic) {
  const HeightGrid grid = test::rough_terrain(60, 50, 3);
  const auto a = simplify({grid, 30, 30}, options({.ratio = 0.05}));
  const auto b = simplify({grid, 30, 30}, options({.ratio = 0.05}));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->tin.vertices, b->tin.vertices);
  EXPECT_EQ(a->tin.triangles, b->tin.triangles);
}

TEST(TriangleCollapse, KeepsASphereASphere) {
  const Tin fine = sphere(4);
  const auto r = triangle_collapse_mesh(fine, {}, options({.triangles = 320}), {});
  ASSERT_TRUE(r);
  EXPECT_LE(r->tin.triangles.size(), 321u);
  const auto mesh = HalfedgeMesh::from_tin(r->tin);
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->check(), "");
  EXPECT_EQ(r->tin.vertices.size() * 2 - 4, r->tin.triangles.size());  // still a sphere (Euler)
  double volume = 0;
  for (const Triangle& t : r->tin.triangles) {
    const Vec3 &a = r->tin.vertices[t[0]], &b = r->tin.vertices[t[1]], &c = r->tin.vertices[t[2]];
    volume += dot(a, cross(b, c)) / 6;
    EXPECT_GT(dot(cross(b - a, c - a), a + b + c), 0);  // all still face outwards
  }
  EXPECT_NEAR(volume, 4.18879, 0.15);
}

}  // namespace
}  // namespace tind
