#include "terrain/mesh/surface_distance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "terrain/mesh/nearest.h"
#include "tests/support/hausdorff.h"

namespace tind {
namespace {

Tin square(double z, int n = 1, double size = 10) {
  Tin tin;
  for (int r = 0; r <= n; ++r)
    for (int c = 0; c <= n; ++c) tin.vertices.push_back({size * c / n, size * r / n, z});
  const unsigned w = unsigned(n + 1);
  for (unsigned r = 0; r < unsigned(n); ++r) {
    for (unsigned c = 0; c < unsigned(n); ++c) {
      const unsigned i = r * w + c;
      tin.triangles.push_back({i, i + 1, i + w + 1});
      tin.triangles.push_back({i, i + w + 1, i + w});
    }
  }
  return tin;
}

TEST(NearestTriangle, AgreesWithLookingAtAll) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> at(-1, 1);
  for (int round = 0; round < 20; ++round) {
    Tin tin;
    const unsigned n = 3 + random() % 60;
    for (unsigned i = 0; i < n; ++i) tin.vertices.push_back({at(random), at(random), at(random)});
    for (unsigned i = 0; i < 1 + random() % 90; ++i)
      tin.triangles.push_back(
          {unsigned(random() % n), unsigned(random() % n), unsigned(random() % n)});
    const NearestTriangle tree(tin);
    for (int q = 0; q < 50; ++q) {
      const Vec3 p{2 * at(random), 2 * at(random), 2 * at(random)};
      double least = 1e300;
      for (const Triangle& t : tin.triangles) {
        // The nearest of many points of the triangle is never nearer than the nearest point.
        for (int i = 0; i <= 20; ++i)
          for (int j = 0; i + j <= 20; ++j) {
            const Vec3 s = tin.vertices[t[0]] * ((20 - i - j) / 20.0) +
                           tin.vertices[t[1]] * (i / 20.0) + tin.vertices[t[2]] * (j / 20.0) - p;
            least = std::min(least, dot(s, s));
          }
      }
      const NearestPoint found = tree.find(p, random() % unsigned(tin.triangles.size()));
      EXPECT_LE(found.squared, least + 1e-12);
      EXPECT_GE(std::sqrt(found.squared), std::sqrt(least) - 0.15);
      EXPECT_EQ(found.triangle, tree.find(p).triangle);
    }
  }
}

TEST(NearestTriangle, LooksAtEachPlaceOnce) {
  Tin tin;
  tin.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 0}};
  tin.triangles.assign(500, {0, 1, 2});
  tin.triangles.push_back({1, 3, 2});
  tin.triangles.insert(tin.triangles.end(), 500, {4, 1, 2});
  const NearestTriangle tree(tin);
  EXPECT_EQ(tree.distinct(), 2u);
  for (const std::uint32_t hint : {0u, 499u, 500u, 1000u}) {
    EXPECT_EQ(tree.find({.2, .2, 1}, hint).triangle, 0u);
    EXPECT_EQ(tree.find({.8, .8, 1}, hint).triangle, 500u);
  }
}

/// Triangles from one corner outwards in a tilted plane, no two with an edge in common.
Tin fan(unsigned n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> at(-1, 1);
  const Vec3 tilt{at(random), at(random), at(random)}, corner{at(random), 1e3 * at(random), 0};
  Tin tin;
  tin.vertices.push_back(corner);
  for (unsigned i = 0; i < n; ++i) {
    for (const double part : {0.0, 0.5}) {
      const double angle = 6.283185307179586 * (i + part) / n;
      const Vec3 p{std::cos(angle), std::sin(angle), 0.01 * at(random)};
      tin.vertices.push_back(corner + p * 100 + tilt * (100 * p.x));
    }
    tin.triangles.push_back({0, 2 * i + 1, 2 * i + 2});
  }
  return tin;
}

TEST(NearestTriangle, LooksAtFewOfManyThatShareACorner) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Tin tin = fan(20000, seed);
    const NearestTriangle tree(tin);
    std::mt19937 random(seed);
    std::uint64_t looked_at = 0, queries = 0;
    for (const Triangle& t : tin.triangles) {
      const double u = double(random() % 1000) / 1000, v = double(random() % 1000) / 1000;
      const Vec3 p = tin.vertices[t[0]] * (1 - u) + tin.vertices[t[1]] * (u * (1 - v)) +
                     tin.vertices[t[2]] * (u * v);
      looked_at += tree.find(p, std::uint32_t(queries)).looked_at;
      ++queries;
    }
    EXPECT_LT(double(looked_at) / double(queries), 400) << seed;
  }
}

/// A mesh whose corners were mixed up: triangles as large as all of it, every way.
Tin jumble(unsigned n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> at(0, 1);
  Tin tin;
  for (unsigned i = 0; i < n; ++i)
    tin.vertices.push_back({5e5 + 1000 * at(random), 5e6 + 1000 * at(random), 200 * at(random)});
  for (unsigned i = 0; i < 2 * n; ++i)
    tin.triangles.push_back(
        {unsigned(random() % n), unsigned(random() % n), unsigned(random() % n)});
  return tin;
}

TEST(NearestTriangle, LooksAtFewOfThoseThatGoEveryWay) {
  const Tin tin = jumble(5000, 1);
  const NearestTriangle tree(tin);
  std::uint64_t looked_at = 0;
  for (std::size_t t = 0; t < tin.triangles.size(); t += 10) {
    const Triangle& c = tin.triangles[t];
    const Vec3 p = tin.vertices[c[0]] * .2 + tin.vertices[c[1]] * .5 + tin.vertices[c[2]] * .3;
    const NearestPoint found = tree.find(p);
    EXPECT_LT(found.squared, 1e-12);
    looked_at += found.looked_at;
  }
  EXPECT_LT(double(looked_at) / 1000, 1500);  // of 10,000; by boxes alone 5,900
}

TEST(NearestTriangle, IsTheFirstOfTheNearestAlsoAmongThoseThatGoEveryWay) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    Tin tin = jumble(200, seed);
    tin.triangles.push_back({7, 7, 9}), tin.triangles.push_back({3, 3, 3});
    const NearestTriangle tree(tin);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> at(-500, 1500);
    for (int q = 0; q < 60; ++q) {
      const Vec3 p = q % 3 == 0 ? tin.vertices[random() % 200]
                                : Vec3{5e5 + at(random), 5e6 + at(random), at(random)};
      double least = HUGE_VAL;
      std::uint32_t first = 0;
      for (std::uint32_t i = 0; i < tin.triangles.size(); ++i) {
        Tin one;
        for (const auto v : tin.triangles[i]) one.vertices.push_back(tin.vertices[v]);
        one.triangles = {{0, 1, 2}};
        const double squared = NearestTriangle(one).find(p).squared;
        if (squared < least) least = squared, first = i;
      }
      const NearestPoint found = tree.find(p, random() % unsigned(tin.triangles.size()));
      ASSERT_EQ(found.squared, least) << seed;
      ASSERT_EQ(found.triangle, first) << seed;
    }
  }
}

TEST(NearestTriangle, IsTheFirstOfTheNearestAlsoAmongLongOnes) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const Tin tin = fan(40 + 10 * seed, seed);
    const NearestTriangle tree(tin);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> at(-1, 1);
    for (int q = 0; q < 100; ++q) {
      const Triangle& t = tin.triangles[random() % tin.triangles.size()];
      const double u = std::abs(at(random));
      const Vec3 off = Vec3{at(random), at(random), at(random)} * (q % 2 == 0 ? 0 : 30);
      const Vec3 p = tin.vertices[0] * (1 - u) + tin.vertices[t[1]] * u + off;
      double least = HUGE_VAL;
      std::uint32_t first = 0;
      for (std::uint32_t i = 0; i < tin.triangles.size(); ++i) {
        Tin one;
        for (const auto v : tin.triangles[i]) one.vertices.push_back(tin.vertices[v]);
        one.triangles = {{0, 1, 2}};
        const double squared = NearestTriangle(one).find(p).squared;
        if (squared < least) least = squared, first = i;
      }
      const NearestPoint found = tree.find(p, random() % unsigned(tin.triangles.size()));
      ASSERT_EQ(found.squared, least) << seed;
      ASSERT_EQ(found.triangle, first) << seed;
    }
  }
}

TEST(SurfaceDistance, OfParallelSquaresIsTheirGap) {
  const SurfaceDistance d = surface_distance(square(0), square(3, 7), {.face_samples = 1000});
  EXPECT_NEAR(d.max, 3, 1e-12);
  EXPECT_NEAR(d.rms, 3, 1e-12);
  EXPECT_NEAR(d.a_to_b.mean, 3, 1e-12);
  EXPECT_NEAR(d.diagonal, std::sqrt(200), 1e-12);
}

TEST(SurfaceDistance, HasTwoSides) {
  // A small square in the plane of a large one: nothing of it is far, but much of the large one is.
  const SurfaceDistance d =
      surface_distance(square(0, 1, 1), square(0, 1, 10), {.face_samples = 20000});
  EXPECT_NEAR(d.a_to_b.max, 0, 1e-12);
  EXPECT_NEAR(d.b_to_a.max, std::sqrt(162), 1e-9);  // its far corner
  EXPECT_EQ(d.max, d.b_to_a.max);
}

TEST(SurfaceDistance, FindsASpikeOfOneVertex) {
  Tin spiked = square(0, 10);
  spiked.vertices[60].z = 5;
  const SurfaceDistance d = surface_distance(square(0), spiked, {.face_samples = 100});
  EXPECT_NEAR(d.max, 5, 1e-12);
  EXPECT_LT(d.rms, 1);
}

TEST(SurfaceDistance, ComparesAttributesAtTheNearestPoint) {
  Tin a = square(0, 4), b = square(0, 9);
  for (const Vec3& v : a.vertices) {
    a.colours.push_back({float(v.x / 10), 0, 0});
    a.normals.push_back({0, 0, 1});
  }
  for (const Vec3& v : b.vertices) {
    b.colours.push_back({float(v.x / 10), 0.25f, 0});
    b.normals.push_back({1, 0, 0});
  }
  const SurfaceDistance d = surface_distance(a, b, {.face_samples = 5000, .threads = 2});
  ASSERT_TRUE(d.colour && d.normal);
  EXPECT_FALSE(d.texture);
  EXPECT_NEAR(d.colour->rms, 0.25, 1e-6);
  EXPECT_NEAR(d.colour->max, 0.25, 1e-6);
  EXPECT_NEAR(d.normal->rms, std::sqrt(2), 1e-6);
}

TEST(SurfaceDistance, IsTheSameForAnyNumberOfThreads) {
  Tin rough = square(0, 20);
  std::mt19937 random(1);
  for (Vec3& v : rough.vertices) v.z = double(random() % 100) / 50;
  const SurfaceDistance one =
      surface_distance(square(1), rough, {.face_samples = 30000, .threads = 1});
  const SurfaceDistance four =
      surface_distance(square(1), rough, {.face_samples = 30000, .threads = 4});
  EXPECT_EQ(one.rms, four.rms);
  EXPECT_EQ(one.max, four.max);
}

/// A bumpy square, and the same with every vertex moved a little.
Tin bumpy(unsigned seed, double move) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> at(-1, 1);
  Tin tin = square(0, 5);
  std::mt19937 shape(3);
  for (Vec3& v : tin.vertices) {
    v.z = 2 * at(shape);
    v = v + Vec3{at(random), at(random), at(random)} * move;
  }
  return tin;
}

TEST(SurfaceDistance, ComesUpToTheBoundedHausdorffDistance) {
  constexpr double kBound = 0.002;
  const Tin base = bumpy(1, 0);
  if (!test::bounded_hausdorff(base, base, kBound)) GTEST_SKIP() << "built without CGAL";
  std::vector<Tin> others;
  for (const unsigned seed : {2u, 3u, 4u}) others.push_back(bumpy(seed, 0.1 * seed));
  Tin coarse = square(0, 2);
  coarse.vertices[4].z = 3;
  others.push_back(coarse);
  for (const Tin& other : others) {
    const SurfaceDistance d = surface_distance(base, other, {.face_samples = 200000});
    for (const auto& [found, truth] :
         {std::pair{d.a_to_b.max, *test::bounded_hausdorff(base, other, kBound)},
          {d.b_to_a.max, *test::bounded_hausdorff(other, base, kBound)}}) {
      EXPECT_LE(found, truth + kBound);         // a sample is never farther than the farthest point
      EXPECT_GE(found, truth - kBound - 0.02);  // and some sample is near that
      EXPECT_GT(truth, 0.1);
    }
  }
}

TEST(SurfaceDistance, MeasuresFewerWhereEachTakesLong) {
  const Tin a = jumble(5000, 1), b = jumble(5000, 2);
  const SurfaceSampling how{.face_samples = 20000, .threads = 1, .most_looks = 1};
  const SurfaceDistance few = surface_distance(a, b, how);
  EXPECT_GT(few.a_to_b.left_out, few.a_to_b.samples);
  const SurfaceDistance all = surface_distance(a, b, {.face_samples = 20000, .threads = 2});
  EXPECT_EQ(all.a_to_b.left_out, 0u);
  EXPECT_EQ(few.a_to_b.samples + few.a_to_b.left_out, all.a_to_b.samples);
  EXPECT_NEAR(few.rms, all.rms, .2 * all.rms);
  EXPECT_LE(few.max, all.max);
  SurfaceSampling threads = how;
  threads.threads = 4;
  EXPECT_EQ(surface_distance(a, b, threads).rms, few.rms);
  const Tin plain = square(0, 20);
  EXPECT_EQ(surface_distance(plain, plain, how).a_to_b.left_out, 0u);
}

}  // namespace
}  // namespace tind
