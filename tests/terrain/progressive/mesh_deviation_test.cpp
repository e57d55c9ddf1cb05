#include "terrain/progressive/stream/mesh_deviation.h"

#include <gtest/gtest.h>

#include <random>

namespace tind {
namespace {

/// A grid of 8 x 8 cells with rough heights, diagonals either way.
Tin rough_mesh(unsigned seed) {
  std::mt19937 dice(seed);
  Tin mesh;
  for (int y = 0; y <= 8; ++y)
    for (int x = 0; x <= 8; ++x)
      mesh.vertices.push_back({double(10 * x), double(10 * y), double(dice() % 100)});
  for (std::uint32_t y = 0; y < 8; ++y) {
    for (std::uint32_t x = 0; x < 8; ++x) {
      const std::uint32_t a = 9 * y + x, b = a + 1, c = a + 10, d = a + 9;
      if (dice() % 2)
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
      else
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, d}, {b, c, d}});
    }
  }
  return mesh;
}

double height(const Tin& mesh, double x, double y) {
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vec3 p{x, y, 0};
    const double area = orient2d(a, b, c), wa = orient2d(b, c, p), wb = orient2d(c, a, p),
                 wc = orient2d(a, b, p);
    if (std::min({wa, wb, wc}) >= -1e-9 * area) return (wa * a.z + wb * b.z + wc * c.z) / area;
  }
  ADD_FAILURE() << x << ", " << y << " is outside";
  return 0;
}

TEST(MeshDeviation, IsTheLargestDistanceOverTheWholeTriangle) {
  std::mt19937 dice(5);
  for (unsigned seed = 0; seed < 4; ++seed) {
    const Tin mesh = rough_mesh(seed);
    MeshDeviation deviation(mesh);
    for (int round = 0; round < 60; ++round) {
      std::array<Vec3, 3> t;
      do {
        for (Vec3& v : t) {
          v = mesh.vertices[dice() % mesh.vertices.size()];
          v.z += double(dice() % 30);
        }
      } while (orient2d(t[0], t[1], t[2]) <= 0);
      const double said = deviation.of(t[0], t[1], t[2]);
      // Dense samples never find more, and come near: both surfaces are at most this steep.
      constexpr int kSteps = 120;
      double found = 0;
      for (int i = 0; i <= kSteps; ++i) {
        for (int j = 0; i + j <= kSteps; ++j) {
          const double wb = double(i) / kSteps, wc = double(j) / kSteps;
          const Vec3 p = t[0] + (t[1] - t[0]) * wb + (t[2] - t[0]) * wc;
          found = std::max(found, std::fabs(p.z - height(mesh, p.x, p.y)));
        }
      }
      ASSERT_LE(found, said + 1e-9);
      ASSERT_GT(found, said - 25) << "of " << said;
    }
    for (const Triangle& t : mesh.triangles)
      EXPECT_EQ(deviation.of(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]), 0);
  }
}

// The edge of the triangle runs along a valley between two posts: vertices alone would not see it.
TEST(MeshDeviation, SeesWhereTwoEdgesCross) {
  Tin mesh;
  mesh.vertices = {{0, 0, 0}, {10, 0, 8}, {10, 10, 0}, {0, 10, 8}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};  // the diagonal lies at 0
  MeshDeviation deviation(mesh);
  const auto& v = mesh.vertices;
  EXPECT_DOUBLE_EQ(deviation.of(v[0], v[1], v[3]), 8);  // its diagonal lies at 8
  EXPECT_DOUBLE_EQ(deviation.of(v[1], v[2], v[3]), 8);
}

}  // namespace
}  // namespace tind
