// Where a point lies in the triangulation that insertion makes.

#include "terrain/simplify/insertion/delaunay_insertion.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/support.h"

namespace tind {
namespace {

TEST(DelaunayInsertion, LocatesAPointAsLookingAtAllTrianglesDoes) {
  const GridSamples samples;
  std::mt19937 random(3);
  Tin corners;
  corners.vertices = {{0, 0, 0}, {64, 0, 0}, {64, 64, 0}, {0, 64, 0}};
  corners.triangles = {{0, 1, 2}, {0, 2, 3}};
  HalfedgeMesh mesh = *HalfedgeMesh::from_tin(corners);
  DelaunayInsertion<GridSamples> insertion(mesh, samples, {});
  const auto somewhere = [&] { return Vec3{double(random() % 65), double(random() % 65), 0}; };
  for (int i = 0; i < 200; ++i) insertion.insert_point(somewhere());
  const auto side = [&](HalfedgeMesh::Index h, const Vec3& p) {
    return orient2d(mesh.position(mesh.origin(h)), mesh.position(mesh.dest(h)), p);
  };
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = somewhere();
    const auto found = insertion.locate(p);
    ASSERT_NE(found.triangle, HalfedgeMesh::kNone);
    int zeros = 0;
    for (HalfedgeMesh::Index h = 3 * found.triangle; h < 3 * found.triangle + 3; ++h) {
      EXPECT_GE(side(h, p), 0);
      zeros += side(h, p) == 0;
    }
    EXPECT_EQ(found.on != HalfedgeMesh::kNone, zeros > 0);
    EXPECT_EQ(found.vertex, zeros == 2);
    if (zeros > 0) {
      EXPECT_EQ(side(found.on, p), 0);
    }
  }
  EXPECT_EQ(insertion.locate({65, 3, 0}).triangle, HalfedgeMesh::kNone);
}

}  // namespace
}  // namespace tind
