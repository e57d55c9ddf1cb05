#include <gtest/gtest.h>

#include <random>

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/common/terrain_mesh.h"
#include "terrain/simplify/options.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/support.h"

namespace tind {
namespace {

SimplifyOptions options(Criterion criterion, StopAt stop) {
  SimplifyOptions o;
  o.method = VertexRemovalOptions{.criterion = criterion};
  o.stop = stop;
  return o;
}

constexpr Criterion kCriteria[] = {Criterion::plane, Criterion::degree, Criterion::k_degree};

TEST(VertexRemoval, TakesAFlatTerrainDownToTwoTriangles) {
  for (const Criterion criterion : kCriteria) {
    const auto r = simplify({HeightGrid(20, 13, 7), 30, 30}, options(criterion, {.triangles = 2}));
    ASSERT_TRUE(r) << r.error().what;
    EXPECT_LE(r->tin.triangles.size(), 3u) << name_of(criterion);
    EXPECT_GE(r->steps, 20u * 13 - 5);
    EXPECT_EQ(r->note, "");
  }
}

TEST(VertexRemoval, PlaneKeepsTheSpikeUntilTheEnd) {
  HeightGrid grid(15, 15, 0);
  grid.at(6, 9) = 100;
  const auto r = simplify({grid, 30, 30}, options(Criterion::plane, {.triangles = 4}));
  ASSERT_TRUE(r);
  bool spike = false;
  for (const Vec3& v : r->tin.vertices) spike |= v == Vec3{6, -9, 100};
  EXPECT_TRUE(spike);
}

TEST(VertexRemoval, StaysValidAndCoversEverythingOnAnyGrid) {
  std::mt19937 random(11);
  for (int round = 0; round < 60; ++round) {
    const HeightGrid grid = test::awkward_grid(random, round);
    const auto full = terrain_mesh({grid, 25, 30});
    if (!full) continue;
    const double area = check_validity(full->mesh.to_tin()).area;
    const auto r = simplify({grid, 25, 30}, options(kCriteria[round % 3], {.ratio = 0.1}));
    ASSERT_TRUE(r) << r.error().what;
    const MeshValidity validity = check_validity(r->tin);
    EXPECT_TRUE(validity.ok()) << validity.first_problem;
    EXPECT_EQ(validity.unused_vertices, 0u);
    EXPECT_NEAR(validity.area, area, 1e-9 * area);
    const double target = std::floor(0.1 * double(r->input_triangles) + 1e-9);
    EXPECT_TRUE(double(r->tin.triangles.size()) <= target || !r->note.empty());
    EXPECT_GE(double(r->tin.triangles.size()), target - 1);
  }
}

TEST(VertexRemoval, KeepsTheErrorBound) {
  const HeightGrid grid = test::rough_terrain(80, 60, 5);
  for (const Criterion criterion : kCriteria) {
    const auto r = simplify({grid, 30, 30}, options(criterion, {.max_error_m = 12}));
    ASSERT_TRUE(r);
    const VerticalError error = vertical_error(r->tin, grid);
    EXPECT_LE(error.max_m, 12 * (1 + 1e-12)) << name_of(criterion);
    EXPECT_EQ(error.uncovered, 0u);
    EXPECT_LT(r->tin.triangles.size(), r->input_triangles / 2);
  }
}

TEST(VertexRemoval, SurvivesVerticesOfAnyDegree) {
  // A flat border makes hubs: hundreds of edges meet at the corners.
  for (const Criterion criterion : kCriteria) {
    const auto r =
        simplify({HeightGrid(300, 300, 0), 30, 30}, options(criterion, {.triangles = 400}));
    ASSERT_TRUE(r);
    EXPECT_TRUE(check_validity(r->tin).ok());
  }
}

TEST(VertexRemoval, IsDeterministic) {
  const HeightGrid grid = test::rough_terrain(60, 50, 3);
  for (const Criterion criterion : kCriteria) {
    const auto a = simplify({grid, 30, 30}, options(criterion, {.ratio = 0.05}));
    const auto b = simplify({grid, 30, 30}, options(criterion, {.ratio = 0.05}));
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->tin.vertices, b->tin.vertices);
    EXPECT_EQ(a->tin.triangles, b->tin.triangles);
  }
}

TEST(VertexRemoval, RefusesNonsenseClearly) {
  const HeightGrid grid(5, 5, 0);
  EXPECT_EQ(simplify({grid, 1, 1}, options(Criterion::plane, {})).error().code,
            Errc::invalid_argument);
  EXPECT_EQ(simplify({grid, 1, 1}, options(Criterion::plane, {.ratio = 2})).error().code,
            Errc::invalid_argument);
  EXPECT_EQ(
      simplify({HeightGrid(9, 1, 0), 1, 1}, options(Criterion::plane, {.ratio = 0.5})).error().code,
      Errc::bad_data);
}

}  // namespace
}  // namespace tind
