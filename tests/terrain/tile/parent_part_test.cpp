// A quarter of a tile as a mesh: all of it, once, whatever the edges through its middle are.

#include "terrain/tile/parent_part.h"

#include <gtest/gtest.h>

#include "terrain/mesh/tin.h"

namespace tind {
namespace {

constexpr double kE = 32767;

/// The square with one vertex in it, to which all its corners have edges.
Tin fan(double x, double y) {
  Tin mesh;
  mesh.vertices = {{0, 0, 0}, {kE, 0, 10}, {kE, kE, 20}, {0, kE, 30}, {x, y, 100}};
  mesh.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  return mesh;
}

double area_of(const Tin& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const double area = orient2d(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
    EXPECT_GT(area, 0);
    sum += area / 2;
  }
  return sum;
}

TEST(ParentPart, IsAllOfTheChildsSquareAlsoOfEdgesThroughTheMiddle) {
  for (int n = 16384; n < 32767; n += 17)
    for (const auto& [x, y] : {std::pair(n, n), {n, 32767 - n}, {32767 - n, n}, {n, 20'000}}) {
      const Tin parent = fan(x, y);
      for (std::uint32_t k = 0; k < 4; ++k) {
        const auto part = parent_part(parent, {1, k % 2, k / 2});
        ASSERT_TRUE(part) << x << " " << y << ": " << part.error().what;
        ASSERT_NEAR(area_of(*part), kE * kE, 1e-3) << x << " " << y;
      }
    }
}

}  // namespace
}  // namespace tind
