// From a model to one that somebody else made of it: both ends exact, every mesh between a
// manifold.

#include "terrain/progressive/between.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "proto/mesh_io.h"
#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/mesh/manifold.h"
#include "terrain/mesh/mesh_frame.h"
#include "terrain/progressive/terrain_transition.h"
#include "tests/support/support.h"
#include "tests/terrain/progressive/shapes.h"

namespace tind {
namespace {

using test::box, test::sphere, test::turned;

/// The mesh after the first `count` splits.
Tin after(const ProgressiveMesh& pm, std::size_t count) {
  TerrainTransition topology;  // the same splits; places are set below
  topology.base = pm.base.triangles;
  topology.vertices.resize(pm.base.vertices.size() + count);
  for (std::size_t i = 0; i < count; ++i)
    topology.splits.push_back({pm.splits[i].vertex, pm.splits[i].left, pm.splits[i].right});
  topology.border_splits = count;
  Tin t = mesh_at(topology, 1);
  std::copy(pm.base.vertices.begin(), pm.base.vertices.end(), t.vertices.begin());
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_EQ(t.vertices[pm.splits[i].vertex], pm.splits[i].vertex_coarse);
    t.vertices[pm.splits[i].vertex] = pm.splits[i].vertex_fine;
    t.vertices[pm.base.vertices.size() + i] = pm.splits[i].added;
  }
  return t;
}

double area(const Tin& t) {
  double sum = 0;
  for (const Triangle& q : t.triangles) {
    const Vec3& a = t.vertices[q[0]];
    sum += length(cross(t.vertices[q[1]] - a, t.vertices[q[2]] - a)) / 2;
  }
  return sum;
}

void expect_exact(const BetweenModels& made, const Tin& fine, const Tin& coarse) {
  EXPECT_EQ(made.mesh.base.vertices, coarse.vertices);
  EXPECT_EQ(made.mesh.base.triangles, coarse.triangles);
  ASSERT_EQ(coarse.vertices.size() + made.mesh.splits.size(), fine.vertices.size() + made.split_in);
  const Tin last = after(made.mesh, made.mesh.splits.size());
  std::set<std::array<double, 3>> there;
  for (const Vec3& v : last.vertices) there.insert({v.x, v.y, v.z});
  for (const Vec3& v : fine.vertices) EXPECT_TRUE(there.contains({v.x, v.y, v.z}));
  EXPECT_EQ(last.triangles.size(), fine.triangles.size() + 2 * made.split_in);
  EXPECT_NEAR(area(last), area(fine), 1e-9 * area(fine));
  std::mt19937 random(1);
  for (int i = 0; i < 30; ++i) {
    const auto mesh = HalfedgeMesh::from_tin(after(made.mesh, random() % made.mesh.splits.size()));
    ASSERT_TRUE(mesh) << mesh.error().what;
  }
  for (std::size_t i = 1; i < made.mesh.splits.size(); ++i)
    EXPECT_LE(made.mesh.splits[i].error_m, made.mesh.splits[i - 1].error_m);
}

TEST(Between, SpheresToABoxHoweverItIsTurned) {
  for (int round = 0; round < 40; ++round) {
    const Tin fine = sphere(20 + 20 * round), coarse = turned(box({-1, -1, -1}, {1, 1, 1}), round);
    const auto made = between_models(fine, coarse);
    ASSERT_TRUE(made) << round << ": " << made.error().what;
    expect_exact(*made, fine, coarse);
  }
}

TEST(Between, OneVertexLess) {  // the paper's extreme case, n = k + 1
  const Tin fine = sphere(31), coarse = turned(sphere(30), 0.3);
  const auto made = between_models(fine, coarse);
  ASSERT_TRUE(made) << made.error().what;
  expect_exact(*made, fine, coarse);
}

TEST(Between, SpotToABox) {
  TIND_NEEDS_SHARED_DATA(path, "mesh/spot.obj");
  auto file = proto::read_mesh(path);
  ASSERT_TRUE(file) << file.error();
  Tin whole = from_file_mesh(std::move(*file));
  whole.texcoords.clear();
  weld(whole);  // what the texture has split
  Vec3 low = whole.vertices[0], high = low;
  for (const Vec3& v : whole.vertices) {
    low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
    high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
  }
  const Tin coarse = box(low, high);
  ASSERT_LT(coarse.vertices.size(), 20u);
  const auto made = between_models(whole, coarse);
  ASSERT_TRUE(made) << made.error().what;
  std::printf("spot: %zu vertices to %zu, %zu split in\n", whole.vertices.size(),
              coarse.vertices.size(), made->split_in);
  expect_exact(*made, whole, coarse);
}

TEST(Between, WhatCannotBeIsRefusedWithItsPlace) {
  const Tin coarse = box({-1, -1, -1}, {1, 1, 1});
  Tin open = sphere(50);
  open.triangles.pop_back();
  const auto made = between_models(open, coarse);
  ASSERT_FALSE(made);
  EXPECT_NE(made.error().what.find("not closed at ("), std::string::npos);
  Tin twice = coarse;
  for (const Triangle& t : coarse.triangles)
    twice.triangles.push_back({t[0] + 14, t[1] + 14, t[2] + 14});
  twice.vertices.insert(twice.vertices.end(), coarse.vertices.begin(), coarse.vertices.end());
  EXPECT_FALSE(between_models(twice, coarse));
  EXPECT_FALSE(between_models(coarse, sphere(50)));
}

}  // namespace
}  // namespace tind
