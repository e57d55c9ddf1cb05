// The way from a coarse terrain mesh to a fine one: exact at both ends, never a flip between, and
// one line on a shared side whoever asks.

#include "terrain/progressive/transition/terrain_transition.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/mesh/validity.h"
#include "terrain/progressive/transition/overlay.h"

namespace tind {
namespace {

constexpr double kExtent = 1000;

/// A random triangulation of a square with random heights; `side` heights come from the seed alone.
Tin random_square(std::mt19937& random, int inside, int on_sides, double extent = kExtent) {
  std::uniform_int_distribution<int> at(1, int(extent) - 1), height(0, 500);
  Tin t;
  t.vertices = {{0, 0, 3}, {extent, 0, 50}, {extent, extent, 20}, {0, extent, 70}};
  t.triangles = {{0, 1, 2}, {0, 2, 3}};
  HalfedgeMesh m = *HalfedgeMesh::from_tin(t);
  for (int i = 0; i < on_sides; ++i) {
    std::vector<HalfedgeMesh::Index> border;
    for (HalfedgeMesh::Index h = 0; h < m.halfedge_slots(); ++h)
      if (m.twin(h) == HalfedgeMesh::kNone) border.push_back(h);
    const auto h = border[random() % border.size()];
    const Vec3 &a = m.position(m.origin(h)), &b = m.position(m.dest(h));
    const Vec3 p{std::floor((a.x + b.x) / 2), std::floor((a.y + b.y) / 2), double(height(random))};
    if ((p.x == a.x && p.y == a.y) || (p.x == b.x && p.y == b.y)) continue;
    m.split_edge(h, p);
  }
  for (int i = 0; i < inside; ++i) {
    const Vec3 p{double(at(random)), double(at(random)), double(height(random))};
    for (HalfedgeMesh::Index h = 0; h < m.halfedge_slots(); h += 3) {
      bool in = true;
      for (HalfedgeMesh::Index e = h; e < h + 3; ++e)
        in = in && orient2d(m.position(m.origin(e)), m.position(m.dest(e)), p) > 0;
      if (!in) continue;
      m.split_triangle(h / 3, p);
      break;
    }
  }
  return m.to_tin();
}

double height_at(const Tin& t, double x, double y) {
  const Vec3 p{x, y, 0};
  for (const Triangle& q : t.triangles) {
    const Vec3 &a = t.vertices[q[0]], &b = t.vertices[q[1]], &c = t.vertices[q[2]];
    const double area = orient2d(a, b, c), wb = orient2d(a, p, c) / area,
                 wc = orient2d(a, b, p) / area;
    if (wb >= -1e-12 && wc >= -1e-12 && wb + wc <= 1 + 1e-12)
      return a.z + wb * (b.z - a.z) + wc * (c.z - a.z);
  }
  return NAN;
}

void expect_no_flip(const Tin& t, double s) {
  double area = 0;
  for (const Triangle& q : t.triangles) {
    const double twice = orient2d(t.vertices[q[0]], t.vertices[q[1]], t.vertices[q[2]]);
    EXPECT_GE(twice, -1e-7) << "at s = " << s;
    area += twice / 2;
  }
  EXPECT_NEAR(area, kExtent * kExtent, 1e-6) << "at s = " << s;
}

TEST(TerrainTransition, BothEndsAreExact) {
  std::mt19937 random(1);
  for (int round = 0; round < 60; ++round) {
    const Tin fine = random_square(random, 10 + round, round % 17);
    const Tin coarse = random_square(random, round / 4, round % 7);
    const auto t = terrain_transition(fine, coarse);
    ASSERT_TRUE(t) << t.error().what;
    const Tin low = mesh_at(*t, 0);
    EXPECT_EQ(low.vertices, coarse.vertices);
    EXPECT_EQ(low.triangles, coarse.triangles);

    const Tin high = mesh_at(*t, 1);
    EXPECT_TRUE(check_validity(high).ok()) << check_validity(high).first_problem;
    std::map<std::pair<double, double>, double> at;
    for (const Vec3& v : high.vertices) at[{v.x, v.y}] = v.z;
    for (const Vec3& v : fine.vertices) {
      ASSERT_TRUE(at.contains({v.x, v.y}));
      EXPECT_NEAR((at[{v.x, v.y}]), v.z, 1e-9);
    }
    for (int i = 0; i < 100; ++i) {
      const double x = double(random() % 1000000) / 1000, y = double(random() % 1000000) / 1000;
      EXPECT_NEAR(height_at(high, x, y), height_at(fine, x, y), 1e-6);
    }
  }
}

TEST(TerrainTransition, NothingFlipsOnTheWay) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> anywhere(0, 1);
  for (int round = 0; round < 20; ++round) {
    const auto t = terrain_transition(random_square(random, 80, 12), random_square(random, 15, 5));
    ASSERT_TRUE(t) << t.error().what;
    for (int i = 0; i < 60; ++i) {
      const double s = anywhere(random);
      const Tin mesh = mesh_at(*t, s);
      expect_no_flip(mesh, s);
      EXPECT_TRUE(HalfedgeMesh::from_tin(mesh));
    }
  }
}

TEST(TerrainTransition, NothingJumps) {
  std::mt19937 random(3);
  const auto t = terrain_transition(random_square(random, 60, 9), random_square(random, 9, 4));
  ASSERT_TRUE(t) << t.error().what;
  const double x = 411.3, y = 587.7;
  double before = height_at(mesh_at(*t, 0), x, y), largest = 0;
  for (int i = 1; i <= 20000; ++i) {
    const double now = height_at(mesh_at(*t, i / 20000.0), x, y);
    largest = std::max(largest, std::abs(now - before));
    before = now;
  }
  EXPECT_LT(largest, 5);  // of a relief of 500
  EXPECT_GT(largest, 0);
}

TEST(TerrainTransition, ASideIsTheMeanOfTheTwoLines) {
  std::mt19937 random(4);
  const Tin fine = random_square(random, 50, 12), coarse = random_square(random, 10, 6);
  const auto t = terrain_transition(fine, coarse);
  ASSERT_TRUE(t) << t.error().what;
  for (const double s : {0.001, 0.25, 0.7, 0.999}) {
    const Tin mesh = mesh_at(*t, s);
    for (double along = 0.5; along < kExtent; along += 13.1)
      EXPECT_NEAR(height_at(mesh, along, 0),
                  (1 - s) * height_at(coarse, along, 0) + s * height_at(fine, along, 0), 1e-9);
  }
}

TEST(TerrainTransition, CrossingsDoNotBreedCrossings) {
  std::mt19937 random(6);
  for (int round = 0; round < 5; ++round) {
    const Tin fine = random_square(random, 200, 10), coarse = random_square(random, 150, 10);
    const auto laid = overlay(fine, coarse);
    ASSERT_TRUE(laid) << laid.error().what;
    const auto t = terrain_transition(fine, coarse);
    ASSERT_TRUE(t) << t.error().what;
    EXPECT_GE(laid->mesh.vertex_slots(), t->vertices.size());
    EXPECT_LT(laid->mesh.vertex_slots(), t->vertices.size() * 3 / 2);
  }
}

TEST(TerrainTransition, MeshesFullOfVerticesOnOneLineAreLaidOverEachOther) {
  // Nearly every place of a small lattice is taken, so most edges go through vertices of the other.
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    const Tin fine = random_square(random, 200, 8, 40), coarse = random_square(random, 200, 8, 40);
    const auto t = terrain_transition(fine, coarse);
    ASSERT_TRUE(t) << t.error().what;
    for (const double s : {0.3, 1.0})
      for (const Tin mesh = mesh_at(*t, s); const Triangle& q : mesh.triangles)
        ASSERT_GE(orient2d(mesh.vertices[q[0]], mesh.vertices[q[1]], mesh.vertices[q[2]]), -1e-7);
  }
}

TEST(TerrainTransition, EndsWhenItIsTold) {
  std::mt19937 random(7);
  const Tin fine = random_square(random, 20, 2), coarse = random_square(random, 5, 2);
  std::stop_source stop;
  ASSERT_TRUE(terrain_transition(fine, coarse, stop.get_token()));
  stop.request_stop();
  const auto t = terrain_transition(fine, coarse, stop.get_token());
  ASSERT_FALSE(t);
  EXPECT_EQ(t.error().code, Errc::cancelled);
}

TEST(TerrainTransition, MeshesOfDifferentRectanglesAreRefused) {
  std::mt19937 random(5);
  Tin fine = random_square(random, 5, 2), coarse = fine;
  for (Vec3& v : coarse.vertices) v.x *= 2;
  const auto t = terrain_transition(fine, coarse);
  ASSERT_FALSE(t);
  EXPECT_EQ(t.error().code, Errc::bad_data);
  EXPECT_NE(t.error().what.find("same rectangle"), std::string::npos);
}

}  // namespace
}  // namespace tind
