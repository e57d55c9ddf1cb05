#include "terrain/simplify/clustering/clustering.h"

#include <gtest/gtest.h>

#include <random>

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/support.h"

namespace tind {
namespace {

SimplifyOptions options(StopAt stop) {
  SimplifyOptions o;
  o.method = ClusterOptions{};
  o.stop = stop;
  return o;
}

TEST(Clustering, TheFinestDivisionIsTheFullMesh) {
  const HeightGrid grid = test::rough_terrain(20, 31, 4);
  const auto r = simplify({grid, 30, 30}, options({.ratio = 1}));
  ASSERT_TRUE(r);
  EXPECT_EQ(r->tin.triangles.size(), 2u * 19 * 30);
  EXPECT_EQ(vertical_error(r->tin, grid).max_m, 0);
  EXPECT_EQ(r->note, "");
}

TEST(Clustering, APlaneStaysAPlane) {
  HeightGrid grid(40, 30, 0);
  for (int r = 0; r < 30; ++r)
    for (int c = 0; c < 40; ++c) grid.at(c, r) = float(3 * c - 2 * r);
  const auto r = simplify({grid, 10, 20}, options({.triangles = 60}));
  ASSERT_TRUE(r);
  EXPECT_LT(vertical_error(r->tin, grid).max_m, 0.05);
}

TEST(Clustering, PutsTheVertexOfARoofOnItsRidge) {
  HeightGrid grid(31, 31, 0);
  for (int r = 0; r < 31; ++r)
    for (int c = 0; c < 31; ++c) grid.at(c, r) = float(-10 * std::abs(c - 13));
  // Three columns of clusters; the ridge at column 13 is not in the middle of the second.
  const auto tin = cluster_rows({31, 31, 3, 3}, 1, 1, [&](int row, std::span<float> out) {
    std::ranges::copy(grid.row(row), out.begin());
    return Result<void>{};
  });
  ASSERT_TRUE(tin);
  EXPECT_NEAR(tin->vertices[4].x, 13, 0.05);
  EXPECT_NEAR(tin->vertices[4].z, 0, 0.5);
}

TEST(Clustering, StaysValidAndCoversEveryPostOnAnyGrid) {
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    HeightGrid grid(2 + int(random() % 40), 2 + int(random() % 40), 0);
    for (float& z : grid.values()) {
      z = round % 3 == 0 ? float(random() % 2 * 1000) : float(random() % 1000) / 7;
      if (round % 2 == 1 && random() % 20 < unsigned(round % 20)) z = HeightGrid::kVoid;
    }
    const double ratio = 0.01 + 0.99 * double(random() % 100) / 100;
    const auto r = simplify({grid, 25, 30}, options({.ratio = ratio}));
    if (!r) {
      EXPECT_EQ(r.error().code, Errc::bad_data);
      continue;
    }
    const MeshValidity validity = check_validity(r->tin);
    EXPECT_TRUE(validity.ok()) << validity.first_problem;
    EXPECT_EQ(vertical_error(r->tin, grid).uncovered, 0u);
    if (round % 2 == 0) {
      EXPECT_EQ(validity.area, double(grid.cols() - 1) * (grid.rows() - 1));
      EXPECT_LE(double(r->tin.triangles.size()),
                std::max(2.0, ratio * double(r->input_triangles) + 1));
    }
  }
}

TEST(Clustering, KeepsTheErrorBound) {
  const HeightGrid grid = test::rough_terrain(90, 70, 9);
  const auto r = simplify({grid, 30, 30}, options({.max_error_m = 40}));
  ASSERT_TRUE(r);
  EXPECT_LE(vertical_error(r->tin, grid).max_m, 40);
  EXPECT_LT(r->tin.triangles.size(), r->input_triangles);
}

TEST(Clustering, ReadsEachRowOnceInOrderAndPassesErrorsOn) {
  int next = 0;
  const auto tin = cluster_rows({9, 1000, 3, 100}, 1, 1, [&](int row, std::span<float> out) {
    EXPECT_EQ(row, next++);
    std::ranges::fill(out, float(row));
    return Result<void>{};
  });
  ASSERT_TRUE(tin);
  EXPECT_EQ(next, 1000);
  EXPECT_EQ(tin->vertices.size(), 300u);
  const auto broken = cluster_rows({9, 10, 3, 3}, 1, 1, [&](int, std::span<float>) -> Result<void> {
    return fail(Errc::io, "disk gone");
  });
  EXPECT_EQ(broken.error().what, "disk gone");
}

TEST(Clustering, AStreamGivesWhatTheGridGives) {
  for (const bool voids : {false, true}) {
    HeightGrid grid = test::rough_terrain(120, 80, 3);
    if (voids)
      for (int r = 10; r < 60; ++r)
        for (int c = 0; c < 70; ++c) grid.at(c, r) = HeightGrid::kVoid;
    int rows = 0;
    const auto streamed = cluster_stream(120, 80, 30, 20, {.ratio = 0.1},
                                         [&](int row, std::span<float> out) -> Result<void> {
                                           ++rows;
                                           std::ranges::copy(grid.row(row), out.begin());
                                           return {};
                                         });
    ASSERT_TRUE(streamed) << streamed.error().what;
    const auto whole = simplify({grid, 30, 20}, options({.ratio = 0.1}));
    EXPECT_EQ(streamed->input_triangles, whole->input_triangles);
    EXPECT_TRUE(check_validity(streamed->tin).ok());
    EXPECT_EQ(vertical_error(streamed->tin, grid).uncovered, 0u);
    const double target = 0.1 * double(streamed->input_triangles);
    EXPECT_LE(double(streamed->tin.triangles.size()), target);
    if (voids) {
      EXPECT_LE(rows, 3 * 80);
      EXPECT_GT(double(streamed->tin.triangles.size()), 0.9 * target);
    } else {
      EXPECT_EQ(rows, 80);
      EXPECT_EQ(streamed->tin.vertices, whole->tin.vertices);
      EXPECT_EQ(streamed->tin.triangles, whole->tin.triangles);
    }
  }
}

TEST(Clustering, OfMoreTrianglesThanThereAreItIsTheFullMesh) {
  const HeightGrid grid = test::rough_terrain(24, 17, 3);
  for (const std::uint64_t count :
       {std::uint64_t(736), std::uint64_t(1) << 40, ~std::uint64_t(0)}) {
    SimplifyOptions o;
    o.method = ClusterOptions{};
    o.stop.triangles = count;
    const auto made = simplify({grid, 1, 1}, o);
    ASSERT_TRUE(made) << made.error().what;
    EXPECT_EQ(made->tin.triangles.size(), 736u) << count;
  }
}

}  // namespace
}  // namespace tind
