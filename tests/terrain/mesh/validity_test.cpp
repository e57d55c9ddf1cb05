#include "terrain/mesh/validity.h"

#include <gtest/gtest.h>

namespace tind {
namespace {

Tin square() {
  return {{{0, 0, 0}, {2, 0, 5}, {2, 2, 0}, {0, 2, 9}}, {{0, 1, 2}, {0, 2, 3}}, {}, {}, {}};
}

TEST(Validity, ASquareIsValid) {
  const MeshValidity v = check_validity(square());
  EXPECT_TRUE(v.ok()) << v.first_problem;
  EXPECT_EQ(v.border_edges, 4u);
  EXPECT_EQ(v.unused_vertices, 0u);
  EXPECT_DOUBLE_EQ(v.area, 4);
}

TEST(Validity, CountsClockwiseAndFlatTriangles) {
  Tin tin = square();
  std::swap(tin.triangles[0][0], tin.triangles[0][1]);
  EXPECT_EQ(check_validity(tin).flipped, 1u);
  EXPECT_GE(check_validity(tin).non_manifold, 1u) << "the diagonal is used twice in one direction";
  tin = square();
  tin.vertices[1] = {1, 1, 0};  // on the diagonal: no area
  EXPECT_EQ(check_validity(tin).flipped, 1u);
}

TEST(Validity, CountsBadIndicesFansAndUnusedVertices) {
  Tin tin = square();
  tin.triangles.push_back({0, 1, 9});
  tin.triangles.push_back({3, 3, 1});
  EXPECT_EQ(check_validity(tin).bad_indices, 2u);
  tin = square();
  tin.vertices.push_back({9, 9, 9});
  EXPECT_EQ(check_validity(tin).unused_vertices, 1u);
  EXPECT_TRUE(check_validity(tin).ok());
  tin.vertices.push_back({4, 3, 0});
  tin.vertices.push_back({3, 4, 0});
  tin.triangles.push_back({2, 5, 6});  // touches the square at one corner only
  const MeshValidity v = check_validity(tin);
  EXPECT_EQ(v.non_manifold, 1u);
  EXPECT_NE(v.first_problem.find("vertex 2"), std::string::npos) << v.first_problem;
}

}  // namespace
}  // namespace tind
