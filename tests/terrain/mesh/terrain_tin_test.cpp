#include "terrain/mesh/terrain_tin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "terrain/mesh/triangle_tree.h"
#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"

namespace tind {
namespace {

using testing::HasSubstr;

/// cols x rows vertices, 1 apart from `corner` on, at height `z`.
Tin sheet(int cols, int rows, Vec3 corner = {}) {
  Tin tin;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < cols; ++c)
      tin.vertices.push_back({corner.x + c, corner.y + r, corner.z + c * r % 5});
  const auto at = [&](int c, int r) { return std::uint32_t(r * cols + c); };
  for (int r = 0; r + 1 < rows; ++r)
    for (int c = 0; c + 1 < cols; ++c) {
      tin.triangles.push_back({at(c, r), at(c + 1, r), at(c + 1, r + 1)});
      tin.triangles.push_back({at(c, r), at(c + 1, r + 1), at(c, r + 1)});
    }
  return tin;
}

Tin both(Tin a, const Tin& b) {
  const auto n = std::uint32_t(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& [i, j, k] : b.triangles) a.triangles.push_back({i + n, j + n, k + n});
  return a;
}

void expect_refused(const Tin& tin, const char* why) {
  const auto made = as_terrain(tin);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, Errc::bad_data);
  EXPECT_THAT(made.error().what, HasSubstr(why));
}

TEST(AsTerrain, LeavesTerrainAsItIs) {
  const Tin tin = sheet(5, 4, {600000.1, 5100000.7, 3});
  const auto made = as_terrain(tin);
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_EQ(made->vertices, tin.vertices);
  EXPECT_EQ(made->triangles, tin.triangles);
}

TEST(AsTerrain, TurnsTrianglesUpWhicheverWayTheFileRuns) {
  Tin tin = sheet(5, 4);
  for (std::size_t t = 0; t < tin.triangles.size(); ++t)
    if (t % 3) std::swap(tin.triangles[t][0], tin.triangles[t][2]);
  const auto made = as_terrain(tin);
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_EQ(check_validity(*made).flipped, 0u);
  EXPECT_EQ(made->triangles.size(), tin.triangles.size());
}

TEST(AsTerrain, WeldsWhatOnlyAttributesKeptApart) {
  Tin tin = both(sheet(3, 3), sheet(3, 3, {2, 0, 0}));
  tin.vertices[9 + 3].z = tin.vertices[5].z;  // the seam at x = 2, of which one row has its height
  tin.vertices[9 + 6].z = tin.vertices[8].z;
  tin.colours.assign(tin.vertices.size(), {1, 0, 0});
  const auto made = as_terrain(tin);
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_EQ(made->vertices.size(), 15u);
  EXPECT_TRUE(made->colours.empty());
}

TEST(AsTerrain, TakesHolesAndParts) {
  Tin tin = sheet(6, 6);
  tin.triangles.erase(tin.triangles.begin() + 24, tin.triangles.begin() + 26);
  EXPECT_TRUE(as_terrain(both(tin, sheet(3, 3, {20, 20, 0}))));
  EXPECT_TRUE(as_terrain(both(tin, sheet(3, 3, {5, 5, 0}))));  // a corner of each in one place
}

TEST(AsTerrain, RefusesAVerticalFace) {
  Tin tin = sheet(3, 3);
  tin.vertices.push_back({1, 0, 90});
  tin.triangles.push_back({0, 1, 9});
  expect_refused(tin, "vertical face");
}

TEST(AsTerrain, RefusesWhatLiesAboveItself) {
  const Tin low = sheet(4, 4);
  for (const Vec3& corner : {Vec3{0, 0, 9},       // exactly above
                             Vec3{0.5, 0.25, 9},  // beside
                             Vec3{1, 1, 9}})
    expect_refused(both(low, sheet(4, 4, corner)), "above one another");
  expect_refused(both(sheet(9, 9), sheet(2, 2, {3.2, 3.2, 5})), "above one another");
}

TEST(AsTerrain, RefusesABridgeThatHasNoVertexAboveTheOther) {
  Tin road, bridge;
  road.vertices = {{-5, -0.1, 0}, {5, -0.1, 0}, {5, 0.1, 0}, {-5, 0.1, 0}};
  bridge.vertices = {{-0.1, -5, 9}, {0.1, -5, 9}, {0.1, 5, 9}, {-0.1, 5, 9}};
  road.triangles = bridge.triangles = {{0, 1, 2}, {0, 2, 3}};
  expect_refused(both(road, bridge), "above one another");
}

TEST(AsTerrain, RefusesARampThatWindsUp) {
  Tin ramp;
  for (int i = 0; i <= 30; ++i) {
    const double a = 0.3 * i;
    for (const double r : {1.0, 2.0})
      ramp.vertices.push_back({r * std::cos(a), r * std::sin(a), 0.2 * i});
  }
  for (std::uint32_t i = 0; i < 30; ++i) {
    ramp.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 3});
    ramp.triangles.push_back({2 * i, 2 * i + 3, 2 * i + 2});
  }
  expect_refused(ramp, "above one another");
  ramp.triangles.resize(40);  // less than once around
  EXPECT_TRUE(as_terrain(ramp));
}

TEST(AsTerrain, RefusesATriangleThatIsThereTwiceAndAMeshWithoutAny) {
  Tin tin = sheet(3, 3);
  tin.triangles.push_back(tin.triangles[3]);
  expect_refused(tin, "above one another");
  expect_refused({}, "no triangle");
}

TEST(TriangleTree, FindsWhatABoxMeetsAndNothingElse) {
  Tin tin = sheet(30, 20);
  tin.vertices.push_back({-1e6, -1e6, 0});  // most are far from the middle of all
  tin.vertices.push_back({-1e6, -1e6 + 1, 0});
  tin.vertices.push_back({-1e6 + 1, -1e6, 0});
  tin.triangles.push_back({600, 601, 602});
  const TriangleTree tree(tin);
  for (const PlaneBox& box : {PlaneBox{{3, 4}, {3, 4}}, PlaneBox{{2.5, 1.5}, {9.25, 2}},
                              PlaneBox{{-2e6, -2e6}, {0, 0}}, PlaneBox{{-9, -9}, {-8, -8}}}) {
    std::vector<std::uint32_t> found, expected;
    tree.each_near(box, [&](std::uint32_t t) { return found.push_back(t), true; });
    for (std::uint32_t t = 0; t < tin.triangles.size(); ++t)
      if (box_of(tin, tin.triangles[t]).meets(box)) expected.push_back(t);
    EXPECT_THAT(found, testing::UnorderedElementsAreArray(expected));
  }
}

}  // namespace
}  // namespace tind
