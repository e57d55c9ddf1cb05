// From a model to one that somebody else made of it: both ends exact, every mesh between
// a manifold.

#include "terrain/progressive/between/between.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "proto/mesh/mesh_io.h"
#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/mesh/manifold.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/mesh/mesh_frame.h"
#include "tests/support/support.h"
#include "tests/terrain/progressive/expand.h"
#include "tests/terrain/progressive/shapes.h"

namespace tind {
namespace {

using test::box, test::sphere, test::turned;

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
  const Tin last = test::expand(made.mesh, made.mesh.splits.size());
  std::set<std::array<double, 3>> there;
  for (const Vec3& v : last.vertices) there.insert({v.x, v.y, v.z});
  for (const Vec3& v : fine.vertices) EXPECT_TRUE(there.contains({v.x, v.y, v.z}));
  EXPECT_GE(last.triangles.size(), fine.triangles.size() + made.split_in);  // one at a border
  EXPECT_LE(last.triangles.size(), fine.triangles.size() + 2 * made.split_in);
  EXPECT_NEAR(area(last), area(fine), 1e-9 * area(fine));
  std::mt19937 random(1);
  for (int i = 0; i < 30; ++i) {
    const auto mesh =
        HalfedgeMesh::from_tin(test::expand(made.mesh, random() % made.mesh.splits.size()));
    ASSERT_TRUE(mesh) << mesh.error().what;
  }
  Tin state = made.mesh.base;
  for (const VertexSplit& s : made.mesh.splits) {
    ASSERT_EQ(state.vertices[s.vertex], s.vertex_coarse);
    state.vertices[s.vertex] = s.vertex_fine;
    state.vertices.push_back(s.added);
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
  auto file = read_mesh(path);
  ASSERT_TRUE(file) << file.error().what;
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
  std::printf("spot: %zu vertices to %zu, %zu split in, %zu turned\n", whole.vertices.size(),
              coarse.vertices.size(), made->split_in, made->turned);
  expect_exact(*made, whole, coarse);
}

/// In place of the coarse model's own: somewhere near.
Tin moved(Tin t, double by, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> d(-by, by);
  for (Vec3& v : t.vertices) v = v + Vec3{d(random), d(random), d(random)};
  return t;
}

TEST(Between, OpenModelsKeepBordersOnBorders) {
  for (std::uint32_t round = 0; round < 30; ++round) {
    const int n = int(round % 4) + 1;
    const Tin fine = test::split_at_random(test::hills(6 + n), 20 * n, round);
    const Tin coarse = moved(test::hills(n), 0.05, round);
    const auto made = between_models(fine, coarse);
    ASSERT_TRUE(made) << round << ": " << made.error().what;
    expect_exact(*made, fine, coarse);
  }
}

TEST(Between, TubesHaveTwoBorders) {
  for (std::uint32_t round = 0; round < 20; ++round) {
    const Tin fine = test::split_at_random(test::tube(8, 9), int(30 * round), round);
    const Tin coarse = turned(test::tube(1 + int(round % 3), 3 + int(round % 4)), 0.3 * round);
    const auto made = between_models(fine, coarse);
    ASSERT_TRUE(made) << round << ": " << made.error().what;
    expect_exact(*made, fine, coarse);
  }
}

TEST(Between, ACoarseBorderMayHaveMoreVertices) {
  const Tin fine = test::hills(2);  // 8 of its 9 on the border
  Tin coarse;                       // a round fan
  for (int i = 0; i < 9; ++i)
    coarse.vertices.push_back(
        {0.5 + 0.5 * std::cos(i * 0.698), 0.5 + 0.5 * std::sin(i * 0.698), 0});
  for (std::uint32_t i = 1; i + 1 < 9; ++i) coarse.triangles.push_back({0, i, i + 1});
  const auto made = between_models(fine, coarse);
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_GE(made->split_in, 1u);
  expect_exact(*made, fine, coarse);
}

/// Few vertices, places that mean little or nothing: every set is squeezed, most paths need splits.
TEST(Between, AnySphereOrDiscToAnyOther) {
  int made_of_few = 0;
  for (std::uint32_t round = 0; round < 30; ++round) {
    std::mt19937 random(round);
    const int n = int(random() % 20), k = int(random() % std::uint32_t(n + 1));
    const bool disc = round % 3 == 0;
    const auto model = [&](int splits) {
      return disc ? test::split_at_random(test::hills(2), splits, random())
                  : sphere(splits, random());
    };
    const Tin fine = model(n), coarse = moved(model(k), round % 2 ? 0.5 : 0.1, random());
    const auto made = between_models(fine, coarse);
    if (!made) {
      EXPECT_NE(made.error().what.find("too unlike: at ("), std::string::npos) << made.error().what;
      continue;
    }
    ++made_of_few;
    expect_exact(*made, fine, coarse);
  }
  EXPECT_GT(made_of_few, 25);
}

TEST(Between, ATorusToOneOfFewVertices) {
  const Tin fine = test::torus(30, 16), coarse = test::torus(6, 4);
  const auto made = between_models(fine, coarse);
  ASSERT_TRUE(made) << made.error().what;
  expect_exact(*made, fine, coarse);
}

TEST(Between, TurnedTrianglesAreCountedAsTheyAre) {
  const Tin fine = sphere(300), coarse = turned(moved(sphere(4), 0.8, 5), 2);
  const auto made = between_models(fine, coarse);
  ASSERT_TRUE(made) << made.error().what;
  std::size_t turned_over = 0;
  Tin before = made->mesh.base;
  for (const VertexSplit& s : made->mesh.splits) {
    Tin now = before;
    test::apply_split(now, s);
    const auto normal = [](const Tin& t, std::size_t i) {
      const auto& [a, b, c] = t.triangles[i];
      return cross(t.vertices[b] - t.vertices[a], t.vertices[c] - t.vertices[a]);
    };
    for (std::size_t i = 0; i < before.triangles.size(); ++i) {
      const Vec3 p = normal(before, i), q = normal(now, i);
      turned_over += dot(p, q) <= 0 && length(p) > 0 && length(q) > 0;
    }
    before = std::move(now);
  }
  EXPECT_EQ(made->turned, turned_over);
  EXPECT_GT(turned_over, 0u) << "a coarse model that nobody would make";
}

TEST(Between, WhatCannotBeIsRefusedWithItsPlace) {
  const Tin coarse = box({-1, -1, -1}, {1, 1, 1});
  const auto refused = [](const Tin& fine, const Tin& rough, const char* why) {
    const auto made = between_models(fine, rough);
    ASSERT_FALSE(made) << why;
    EXPECT_NE(made.error().what.find(why), std::string::npos) << made.error().what;
  };
  Tin open = sphere(50);
  open.triangles.pop_back();
  refused(open, coarse, "the fine one's border at (");
  refused(sphere(50), test::hills(2), "the coarse one's border at (");
  refused(test::torus(9, 8), coarse, "handles: 1 and 0");
  Tin twice = coarse;
  for (const Triangle& t : coarse.triangles)
    twice.triangles.push_back({t[0] + 14, t[1] + 14, t[2] + 14});
  twice.vertices.insert(twice.vertices.end(), coarse.vertices.begin(), coarse.vertices.end());
  refused(twice, coarse, "several parts");
  refused(coarse, sphere(50), "more vertices");
  Tin loose = sphere(50);
  loose.vertices.push_back({9, 9, 9});
  refused(loose, coarse, "without triangles at (9");
}

}  // namespace
}  // namespace tind
