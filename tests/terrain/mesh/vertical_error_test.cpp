#include "terrain/mesh/vertical_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "terrain/mesh/scan_triangle.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::grid_from;
using test::rough_terrain;

/// The definition, post by post and triangle by triangle, with barycentric coordinates.
VerticalError by_hand(const Tin& mesh, const HeightGrid& grid) {
  VerticalError out;
  std::vector<double> errors;
  for (int r = 0; r < grid.rows(); ++r) {
    out.row_above_m.push_back(0), out.row_below_m.push_back(0);
    for (int c = 0; c < grid.cols(); ++c) {
      if (grid.is_void(c, r)) continue;
      const Vec3 p{double(c), -double(r), 0};
      double worst = -1, with_sign = 0;
      for (const Triangle& t : mesh.triangles) {
        const Vec3 *a = &mesh.vertices[t[0]], *b = &mesh.vertices[t[1]], *d = &mesh.vertices[t[2]];
        if (orient2d(*a, *b, *d) < 0) std::swap(b, d);
        const double wa = orient2d(p, *b, *d), wb = orient2d(*a, p, *d), wd = orient2d(*a, *b, p);
        if (wa < 0 || wb < 0 || wd < 0) continue;
        const double z = (wa * a->z + wb * b->z + wd * d->z) / (wa + wb + wd);
        const double e = z - grid.at(c, r);
        out.least_above_m = std::max(out.least_above_m, e);
        out.least_below_m = std::max(out.least_below_m, -e);
        if (std::fabs(e) > worst) worst = std::fabs(e), with_sign = e;
      }
      if (worst < 0) {
        ++out.uncovered;
        continue;
      }
      errors.push_back(worst);
      out.bias_m += with_sign;
      (with_sign > 0 ? out.row_above_m : out.row_below_m).back() += worst;
      if (out.max_col < 0 || worst > out.max_m) out.max_m = worst, out.max_col = c, out.max_row = r;
    }
  }
  out.max_above_m = std::max(0.0, out.least_above_m);
  out.max_below_m = std::max(0.0, out.least_below_m);
  out.posts = errors.size();
  for (const double e : errors) out.mean_m += e, out.rms_m += e * e;
  out.mean_m /= double(errors.size());
  out.bias_m /= double(errors.size());
  out.rms_m = std::sqrt(out.rms_m / double(errors.size()));
  std::sort(errors.begin(), errors.end());
  const auto rank = [&](double s) {
    return errors[std::size_t(std::ceil(s * double(errors.size()))) - 1];
  };
  out.p50_m = rank(0.50), out.p95_m = rank(0.95), out.p99_m = rank(0.99);
  return out;
}

void expect_same(const VerticalError& a, const VerticalError& b) {
  EXPECT_NEAR(a.max_m, b.max_m, 1e-9);
  EXPECT_NEAR(a.max_above_m, b.max_above_m, 1e-9);
  EXPECT_NEAR(a.max_below_m, b.max_below_m, 1e-9);
  EXPECT_EQ(a.posts, b.posts);
  EXPECT_EQ(a.uncovered, b.uncovered);
  EXPECT_NEAR(a.mean_m, b.mean_m, 1e-5);  // single errors are kept as float
  EXPECT_NEAR(a.rms_m, b.rms_m, 1e-5);
  EXPECT_NEAR(a.p50_m, b.p50_m, 1e-4);
  EXPECT_NEAR(a.p95_m, b.p95_m, 1e-4);
  EXPECT_NEAR(a.p99_m, b.p99_m, 1e-4);
  EXPECT_NEAR(a.least_above_m, b.least_above_m, 1e-9);
  EXPECT_NEAR(a.least_below_m, b.least_below_m, 1e-9);
  EXPECT_NEAR(a.bias_m, b.bias_m, 1e-5);
  EXPECT_EQ(a.max_col, b.max_col);
  EXPECT_EQ(a.max_row, b.max_row);
  ASSERT_EQ(a.row_above_m.size(), b.row_above_m.size());
  for (std::size_t r = 0; r < a.row_above_m.size(); ++r) {
    EXPECT_NEAR(a.row_above_m[r], b.row_above_m[r], 1e-3) << r;
    EXPECT_NEAR(a.row_below_m[r], b.row_below_m[r], 1e-3) << r;
  }
}

/// The same mesh over the same posts, handed out strip by strip.
VerticalError in_strips(const Tin& mesh, const HeightGrid& grid, double slack = 0) {
  const auto read = [&](int row, int rows) -> Result<HeightGrid> {
    HeightGrid strip(grid.cols(), rows);
    for (int r = 0; r < rows; ++r) std::ranges::copy(grid.row(row + r), strip.row(r).begin());
    return strip;
  };
  const auto got = vertical_error_in_strips(mesh, grid.cols(), grid.rows(), read, 1, slack);
  if (!got) ADD_FAILURE() << got.error().what;
  return got ? *got : VerticalError();
}

/// But for percentiles, which come from a histogram in strips: at most 0.05 % too large.
void expect_same_in_strips(VerticalError strips, const VerticalError& whole) {
  for (const auto figure : {&VerticalError::p50_m, &VerticalError::p95_m, &VerticalError::p99_m}) {
    EXPECT_GE(strips.*figure, whole.*figure * (1 - 1e-6));
    EXPECT_LE(strips.*figure, whole.*figure * 1.0005 + 1e-9);
    strips.*figure = whole.*figure;
  }
  expect_same(strips, whole);
}

TEST(VerticalError, ARimThatIsLevelButForRoundingHoldsAllItsPosts) {
  const HeightGrid grid = grid_from("0 0 7 0 0 / . . . . . / . . . . .");
  for (const double off : {1e-9, -1e-9, 0.0}) {
    for (const double other : {3e-9, -3e-9, 0.0}) {
      // Either end of the rim a little off its row; a corner elsewhere.
      const Tin mesh{{{0, off, 0}, {4, other, 0}, {2, -2, 0}}, {{0, 2, 1}}, {}, {}, {}};
      const VerticalError e = vertical_error(mesh, grid);
      EXPECT_EQ(e.uncovered, 0u) << off << " " << other;
      EXPECT_DOUBLE_EQ(e.max_m, 7) << off << " " << other;
    }
  }
}

TEST(VerticalError, OneTriangleByHand) {
  const HeightGrid grid = grid_from("0 0 0 / 0 5 . / 1 0 0");
  const Tin mesh{{{0, 0, 0}, {0, -2, 2}, {2, 0, 0}}, {{0, 1, 2}}, {}, {}, {}};
  const VerticalError e = vertical_error(mesh, grid);
  // Covered: the top row (0 0 0), (0,1): mesh 1, (1,1): mesh 1 post 5, (0,2): mesh 2 post 1.
  EXPECT_EQ(e.posts, 6u);
  EXPECT_EQ(e.uncovered, 2u);
  EXPECT_DOUBLE_EQ(e.max_m, 4);
  EXPECT_DOUBLE_EQ(e.max_below_m, 4);
  EXPECT_DOUBLE_EQ(e.max_above_m, 1);
  EXPECT_EQ(e.max_col, 1);
  EXPECT_EQ(e.max_row, 1);
  EXPECT_DOUBLE_EQ(e.mean_m, 1);
  EXPECT_DOUBLE_EQ(e.rms_m, std::sqrt(3.0));
}

TEST(VerticalError, OfOnePostAllFiguresAreThatPosts) {
  const HeightGrid grid = grid_from(". . / 5 .");
  const Tin mesh{{{0, 0, 0}, {0, -1, 2}, {1, -1, 2}}, {{0, 1, 2}}, {}, {}, {}};
  const VerticalError e = vertical_error(mesh, grid);
  EXPECT_EQ(e.posts, 1u);
  for (const double figure : {e.max_m, e.mean_m, e.rms_m, e.p50_m, -e.bias_m, e.max_below_m})
    EXPECT_NEAR(figure, 3, 1e-3);
  EXPECT_EQ(e.max_above_m, 0);
  EXPECT_EQ(e.row_below_m, (std::vector<double>{0, 3}));
}

TEST(VerticalError, APostJustOutsideIsMeasuredAtTheRimThatIsNearest) {
  // The rim in the west lies 0.001 east of the first column, on a slope of 10 a column.
  const HeightGrid grid = grid_from("0 . 0 / 0 . 0");
  const Tin mesh{{{0.001, 0, 50.01}, {0.001, -1, 50.01}, {2, -1, 70}, {2, 0, 70}},
                 {{0, 1, 2}, {0, 2, 3}},
                 {},
                 {},
                 {}};
  EXPECT_EQ(vertical_error(mesh, grid).uncovered, 2u);
  const VerticalError e = vertical_error(mesh, grid, 1, 0.01);
  EXPECT_EQ(e.uncovered, 0u);
  EXPECT_NEAR(e.max_m, 70, 1e-9);
  EXPECT_NEAR(e.mean_m, 60.005, 1e-5);
}

TEST(VerticalError, RandomTrianglesAgainstTheDefinition) {
  std::mt19937 random(3);
  for (int round = 0; round < 300; ++round) {
    HeightGrid grid = rough_terrain(3 + int(random() % 30), 3 + int(random() % 30), round);
    for (float& z : grid.values())
      if (random() % 20 == 0) z = HeightGrid::kVoid;
    Tin mesh;
    const int fraction = round % 3 == 0 ? 1 : 16;  // corners on posts, or between them
    const auto coordinate = [&](int n) {
      return double(int(random() % unsigned((n + 8) * fraction)) - 4 * fraction) / fraction;
    };
    for (int t = 0; t < 6; ++t) {
      const std::uint32_t first = std::uint32_t(mesh.vertices.size());
      for (int k = 0; k < 3; ++k)
        mesh.vertices.push_back(
            {coordinate(grid.cols()), -coordinate(grid.rows()), double(random() % 1000) / 7});
      if (orient2d(mesh.vertices[first], mesh.vertices[first + 1], mesh.vertices[first + 2]) == 0)
        mesh.vertices.resize(first);
      else
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    if (mesh.triangles.empty()) continue;
    const VerticalError hand = by_hand(mesh, grid);
    if (hand.posts == 0) {
      EXPECT_EQ(vertical_error(mesh, grid).posts, 0u);
      continue;
    }
    const VerticalError got = vertical_error(mesh, grid);
    expect_same(got, hand);
    expect_same_in_strips(in_strips(mesh, grid), got);
  }
}

/// A sheet z = 10 + 3 x - 2 y whose rims lie `inset` inside those of a grid.
Tin inset_plane(const HeightGrid& grid, double inset) {
  Tin mesh;
  const double e = grid.cols() - 1 - inset, s = grid.rows() - 1 - inset;
  for (const auto& [x, y] : {std::pair{inset, inset}, {inset, s}, {e, s}, {e, inset}})
    mesh.vertices.push_back({x, -y, 10 + 3 * x - 2 * y});
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TEST(VerticalError, AllAroundAMeshThePostsWithinTheSlackAreMeasuredAtItsRim) {
  for (const auto& [cols, rows] : {std::pair{9, 7}, {40, 33}, {20, 257}, {18, 513}, {12, 600}}) {
    HeightGrid grid = rough_terrain(cols, rows, cols);
    grid.at(cols - 1, rows / 2) = HeightGrid::kVoid;
    const double inset = 0.004;
    const Tin mesh = inset_plane(grid, inset);
    VerticalError want;
    for (int r = 0; r < rows; ++r) {
      double above = 0, below = 0;
      for (int c = 0; c < cols; ++c) {
        if (grid.is_void(c, r)) continue;
        const double x = std::clamp(double(c), inset, cols - 1 - inset),
                     y = std::clamp(double(r), inset, rows - 1 - inset);
        const double e = 10 + 3 * x - 2 * y - grid.at(c, r);
        (e > 0 ? above : below) += std::fabs(e);
        if (std::fabs(e) > want.max_m)
          want.max_m = std::fabs(e), want.max_col = c, want.max_row = r;
        ++want.posts;
        want.least_above_m = std::max(want.least_above_m, e);
        want.least_below_m = std::max(want.least_below_m, -e);
      }
      want.row_above_m.push_back(above), want.row_below_m.push_back(below);
    }
    const auto look_at = [&](const VerticalError& got) {
      EXPECT_EQ(got.uncovered, 0u);
      EXPECT_EQ(got.posts, want.posts);
      EXPECT_NEAR(got.max_m, want.max_m, 1e-9);
      EXPECT_EQ(got.max_col, want.max_col);
      EXPECT_EQ(got.max_row, want.max_row);
      EXPECT_NEAR(got.least_above_m, want.least_above_m, 1e-9);
      EXPECT_NEAR(got.least_below_m, want.least_below_m, 1e-9);
      ASSERT_EQ(got.row_above_m.size(), std::size_t(rows));
      for (int r = 0; r < rows; ++r) {
        EXPECT_NEAR(got.row_above_m[r], want.row_above_m[r], 1e-3) << r;
        EXPECT_NEAR(got.row_below_m[r], want.row_below_m[r], 1e-3) << r;
      }
    };
    look_at(vertical_error(mesh, grid, 1, 0.01));
    look_at(vertical_error(mesh, grid, 3, 0.01));
    look_at(in_strips(mesh, grid, 0.01));
    const std::uint64_t rim = 2 * std::uint64_t(cols + rows) - 4 - 1;  // one of them is void
    EXPECT_EQ(vertical_error(mesh, grid, 1, 0.003).uncovered, rim);
    EXPECT_EQ(in_strips(mesh, grid, 0.003).uncovered, rim);
  }
}

TEST(VerticalError, OfManyTrianglesInManyStripsIsThatOfTheWhole) {
  std::mt19937 random(8);
  for (int round = 0; round < 12; ++round) {
    const int cols = 18 + int(random() % 20), rows = 250 + 131 * round;
    HeightGrid grid = rough_terrain(cols, rows, round);
    for (float& z : grid.values())
      if (random() % 20 == 0) z = HeightGrid::kVoid;
    std::uniform_real_distribution<double> x(-3, cols + 2), y(-3, rows + 2);
    Tin mesh;
    for (std::uint32_t i = 0; i < 9; ++i) {
      for (int k = 0; k < 3; ++k)
        mesh.vertices.push_back({x(random), -y(random), double(random() % 500)});
      mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    // Level rims, a hair to either side of where a strip begins.
    for (const double row : {254.996, 255.0, 255.004, 255.996, 256.0, 256.004, 511.996}) {
      const auto n = std::uint32_t(mesh.vertices.size());
      const double far = row + (random() % 2 ? 9.5 : -9.5);
      for (const Vec3& v : {Vec3{0, -row, 700}, {double(cols), -row, 900}, {cols / 2.0, -far, 0}})
        mesh.vertices.push_back(v);
      mesh.triangles.push_back({n, n + 1, n + 2});
    }
    for (const double slack : {0.0, 0.01})
      expect_same_in_strips(in_strips(mesh, grid, slack), vertical_error(mesh, grid, 1, slack));
  }
}

TEST(VerticalError, OfPostsAsFarOffTheFirstIsNamedAboveOrBelow) {
  HeightGrid grid(40, 12, 5);
  grid.at(7, 3) = 1;   // 4 below
  grid.at(20, 3) = 9;  // 4 above, in the same row
  grid.at(2, 9) = 9;
  Tin level;
  level.vertices = {{0, 0, 5}, {0, -11, 5}, {39, -11, 5}, {39, 0, 5}};
  for (const auto& triangles :
       {std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}, {{0, 2, 3}, {0, 1, 2}}}) {
    level.triangles = triangles;
    for (const int threads : {1, 4}) {
      const VerticalError e = vertical_error(level, grid, threads);
      EXPECT_EQ(e.max_m, 4);
      EXPECT_EQ(e.max_col, 7);
      EXPECT_EQ(e.max_row, 3);
    }
  }
  grid.at(7, 3) = 5;
  EXPECT_EQ(vertical_error(level, grid).max_col, 20);
  grid.at(20, 3) = 5, grid.at(30, 9) = 9, grid.at(1, 11) = 9;
  EXPECT_EQ(vertical_error(level, grid, 12).max_col, 2);
  EXPECT_EQ(vertical_error(level, grid, 12).max_row, 9);
  const VerticalError none = vertical_error(level, HeightGrid(40, 12, 5));
  EXPECT_EQ(none.max_m, 0);
  EXPECT_EQ(none.max_col, 0);
  EXPECT_EQ(none.max_row, 0);
}

TEST(VerticalError, WhereverTheOnePostLiesThatIsOffItIsFound) {
  Tin level;
  level.vertices = {{0, 0, 0}, {0, -1, 0}, {52, -1, 0}, {52, 0, 0}};
  level.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (int col = 0; col < 53; ++col) {
    for (const float off : {-0.0625F, 0.0625F}) {
      HeightGrid grid(53, 2, 0);
      grid.at(col, 1) = off;
      for (const VerticalError& e : {vertical_error(level, grid), in_strips(level, grid)}) {
        EXPECT_EQ(e.max_m, 0.0625);
        EXPECT_EQ(e.max_col, col);
        EXPECT_EQ(e.max_row, 1);
        EXPECT_EQ(e.max_above_m, off < 0 ? 0.0625 : 0);
        EXPECT_EQ(e.max_below_m, off > 0 ? 0.0625 : 0);
        EXPECT_EQ(e.p50_m, 0);
        EXPECT_EQ(widened(e, 0.0078125).max_above_m, off < 0 ? 0.0703125 : 0.0078125);
        EXPECT_EQ(widened(e, 0.0078125).max_below_m, off > 0 ? 0.0703125 : 0.0078125);
      }
    }
  }
}

TEST(VerticalError, PercentilesInStripsOfOnePostAndOfTwo) {
  Tin level;
  level.vertices = {{0, 0, 0}, {0, -1, 0}, {1, -1, 0}, {1, 0, 0}};
  level.triangles = {{0, 1, 2}, {0, 2, 3}};
  const VerticalError one = in_strips(level, grid_from("3 . / . ."));
  for (const double figure : {one.p50_m, one.p95_m, one.p99_m}) EXPECT_NEAR(figure, 3, 3 * 0.0005);
  const VerticalError two = in_strips(level, grid_from("3 . / . 70"));
  EXPECT_NEAR(two.p50_m, 3, 3 * 0.0005);
  EXPECT_NEAR(two.p95_m, 70, 70 * 0.0005);
}

TEST(VerticalError, OfNoPostsNothingIsMeasuredAndNothingWidened) {
  Tin level;
  level.vertices = {{0, 0, 5}, {0, -1, 5}, {1, -1, 5}};
  level.triangles = {{0, 1, 2}};
  const HeightGrid voids(3, 3, HeightGrid::kVoid);
  for (const VerticalError& e : {vertical_error(level, voids), in_strips(level, voids)}) {
    EXPECT_EQ(e.posts + e.uncovered, 0u);
    EXPECT_EQ(e.max_m, 0);
    EXPECT_EQ(e.max_col, -1);
    EXPECT_EQ(e.p50_m, 0);
    EXPECT_EQ(e.bias_m, 0);
    EXPECT_EQ(widened(e, 2).max_m, 0);
    EXPECT_EQ(widened(e, 2).least_above_m, -1);
  }
}

TEST(VerticalError, AFullMeshHasNoErrorAndASlantedStripNoGaps) {
  const HeightGrid grid = rough_terrain(40, 30, 5);
  // Long slivers that fan out from one corner: every post lies on or between them.
  Tin fan;
  fan.vertices.push_back({0, 0, 100});
  for (int r = 0; r < 30; ++r) fan.vertices.push_back({39, -double(r), 100});
  for (int c = 38; c >= 0; --c) fan.vertices.push_back({double(c), -29, 100});
  for (std::uint32_t i = 1; i + 1 < fan.vertices.size(); ++i)
    fan.triangles.push_back({0, i + 1, i});
  const VerticalError e = vertical_error(fan, grid);
  EXPECT_EQ(e.uncovered, 0u);
  EXPECT_EQ(e.posts, grid.size());
}

TEST(VerticalError, SharedEdgesThroughFractionalPointsLeaveNoGap) {
  std::mt19937 random(9);
  const HeightGrid grid(64, 64, 0);
  for (int round = 0; round < 200; ++round) {
    // A star of triangles around a point that is no dyadic fraction covers the square.
    const Vec3 w{63 * double(random()) / 4294967296.0, -63 * double(random()) / 4294967296.0, 0};
    Tin star;
    star.vertices = {w, {0, 0, 0}, {0, -63, 0}, {63, -63, 0}, {63, 0, 0}};
    star.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}};
    EXPECT_EQ(vertical_error(star, grid).uncovered, 0u);
  }
}

TEST(VerticalError, DoesNotDependOnThreads) {
  const HeightGrid grid = rough_terrain(97, 61, 4);
  Tin mesh;
  mesh.vertices = {{0, 0, 50}, {0, -60, 90}, {96, -60, 10}, {96, 0, 300}, {40.25, -33.5, 250}};
  mesh.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  const VerticalError one = vertical_error(mesh, grid, 1);
  for (const int threads : {2, 3, 7, 61, 200}) {
    const VerticalError many = vertical_error(mesh, grid, threads);
    EXPECT_EQ(one.max_m, many.max_m);
    EXPECT_EQ(one.rms_m, many.rms_m);
    EXPECT_EQ(one.p95_m, many.p95_m);
    EXPECT_EQ(one.max_col, many.max_col);
    EXPECT_EQ(one.max_row, many.max_row);
  }
}

TEST(VerticalError, InStripsItFindsTheSame) {
  HeightGrid grid = rough_terrain(90, 700, 5);
  for (int c = 10; c < 40; ++c) grid.at(c, 255) = grid.at(c, 300) = HeightGrid::kVoid;
  Tin mesh;  // two triangles over nearly all, one more over part of them, some posts uncovered
  mesh.vertices = {{0, -699, 10}, {89, -699, 400}, {89, 0, 30}, {0.5, 0, 200}, {20, -600, 99}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 1, 2}};
  const VerticalError whole = vertical_error(mesh, grid);
  int rows_read = 0;
  const auto strips = vertical_error_in_strips(
      mesh, 90, 700,
      [&](int row, int rows) -> Result<HeightGrid> {
        EXPECT_EQ(row, rows_read);
        rows_read += rows;
        HeightGrid strip(90, rows);
        for (int r = 0; r < rows; ++r) std::ranges::copy(grid.row(row + r), strip.row(r).begin());
        return strip;
      },
      2);
  ASSERT_TRUE(strips);
  EXPECT_EQ(rows_read, 700);
  EXPECT_EQ(strips->posts, whole.posts);
  EXPECT_EQ(strips->uncovered, whole.uncovered);
  EXPECT_GT(strips->uncovered, 0u);
  EXPECT_NEAR(strips->max_m, whole.max_m, 1e-9);
  EXPECT_EQ(strips->max_col, whole.max_col);
  EXPECT_EQ(strips->max_row, whole.max_row);
  EXPECT_NEAR(strips->rms_m, whole.rms_m, 1e-6);
  EXPECT_NEAR(strips->p99_m, whole.p99_m, 6e-4 * whole.p99_m);
  EXPECT_NEAR(strips->p50_m, whole.p50_m, 6e-4 * whole.p50_m);
  EXPECT_GE(strips->p99_m, whole.p99_m) << "what is said to lie below does";
  EXPECT_GE(strips->p50_m, whole.p50_m);
  EXPECT_NEAR(strips->bias_m, whole.bias_m, 1e-6);
  EXPECT_EQ(strips->row_above_m, whole.row_above_m);
  EXPECT_EQ(strips->row_below_m, whole.row_below_m);
  const auto broken = vertical_error_in_strips(
      mesh, 90, 700, [](int, int) -> Result<HeightGrid> { return fail(Errc::io, "disk gone"); });
  EXPECT_EQ(broken.error().code, Errc::io);
}

TEST(VerticalError, AboveAndBelowAreKeptApart) {
  const HeightGrid grid = grid_from("0 0 0 / 4 . 4");
  Tin mesh;  // flat, at 1
  mesh.vertices = {{0, 0, 1}, {0, -1, 1}, {2, -1, 1}, {2, 0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  const VerticalError e = vertical_error(mesh, grid);
  EXPECT_EQ(e.posts, 5u);
  EXPECT_DOUBLE_EQ(e.bias_m, (3 * 1 - 2 * 3) / 5.0);
  EXPECT_DOUBLE_EQ(e.mean_m, (3 * 1 + 2 * 3) / 5.0);
  EXPECT_EQ(e.row_above_m, (std::vector<double>{3, 0}));
  EXPECT_EQ(e.row_below_m, (std::vector<double>{0, 6}));
}

TEST(VerticalError, WidenedIsThatOfAllThatPostsMayBe) {
  const HeightGrid grid = grid_from("0 0 0 / 0 0 0");
  Tin mesh;  // a quarter of a metre above all posts
  mesh.vertices = {{0, 0, 0.25}, {0, -1, 0.25}, {2, -1, 0.25}, {2, 0, 0.25}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  const VerticalError e = vertical_error(mesh, grid);
  const VerticalError near = widened(e, 0.125), far = widened(e, 0.375);
  EXPECT_DOUBLE_EQ(near.max_m, 0.375);
  EXPECT_DOUBLE_EQ(near.max_above_m, 0.375);
  EXPECT_EQ(near.max_below_m, 0) << "wherever the posts are, the mesh is above";
  EXPECT_DOUBLE_EQ(far.max_m, 0.625);
  EXPECT_DOUBLE_EQ(far.max_below_m, 0.125);
  EXPECT_EQ(widened(e, 0).max_m, e.max_m);
  EXPECT_DOUBLE_EQ(widened(e, 1).max_m, 1.25);
}

TEST(ScanTriangle, TheOrderOfTheCornersDoesNotMatterToTheLastBit) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> at(0, 20);
  for (int round = 0; round < 500; ++round) {
    std::array<Vec3, 3> p;
    for (Vec3& v : p) v = {at(random), -at(random), 100 * at(random)};
    std::vector<double> first;
    std::array<int, 3> order{0, 1, 2};
    do {
      std::vector<double> heights;
      scan_triangle(p[order[0]], p[order[1]], p[order[2]], 0, 20, 20, [&](const PostSpan& s) {
        for (int c = s.first; c <= s.last; ++c) heights.push_back(s.height(c));
        return true;
      });
      if (first.empty()) first = heights;
      EXPECT_EQ(first, heights);
    } while (std::next_permutation(order.begin(), order.end()));
  }
}

TEST(ScanTriangle, FarAwayTrianglesTouchNothing) {
  int calls = 0;
  const auto count = [&](const PostSpan&) { return ++calls, true; };
  scan_triangle({1e300, -1e300, 0}, {1e300, 1, 0}, {2e300, 2, 0}, 0, 10, 10, count);
  scan_triangle({-50, -5, 0}, {-40, -5, 0}, {-40, -9, 0}, 0, 10, 10, count);
  scan_triangle({5, 50, 0}, {6, 50, 0}, {6, 59, 0}, 0, 10, 10, count);
  EXPECT_EQ(calls, 0);
}

std::vector<Vec3> posts_of(const HeightGrid& grid) {
  std::vector<Vec3> posts;
  for (int r = 0; r < grid.rows(); ++r)
    for (int c = 0; c < grid.cols(); ++c)
      if (!grid.is_void(c, r)) posts.push_back({double(c), -double(r), grid.at(c, r)});
  return posts;
}

TEST(VerticalErrorOverPoints, IsThatOverPostsWherePointsArePosts) {
  std::mt19937 random(5);
  for (int round = 0; round < 40; ++round) {
    const HeightGrid grid = test::awkward_grid(random, round);
    Tin mesh;  // of triangles that overlap, cross the border and run either way
    std::uniform_real_distribution<double> x(-3, grid.cols() + 2), y(-3, grid.rows() + 2);
    for (std::uint32_t i = 0; i < 12; ++i) {
      for (int k = 0; k < 3; ++k)
        mesh.vertices.push_back({x(random), -y(random), double(random() % 500)});
      mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    const VerticalError want = vertical_error(mesh, grid);
    const std::vector<Vec3> posts = posts_of(grid);
    const VerticalError got = vertical_error(mesh, posts, 1);
    EXPECT_EQ(got.posts, want.posts);
    EXPECT_EQ(got.uncovered, want.uncovered);
    EXPECT_NEAR(got.max_m, want.max_m, 1e-9);
    EXPECT_NEAR(got.rms_m, want.rms_m, 1e-6 * want.rms_m);
    EXPECT_NEAR(got.p95_m, want.p95_m, 1e-6 * want.p95_m);
    if (want.posts > 0) {
      EXPECT_EQ(got.max_at.x, want.max_col);
      EXPECT_EQ(got.max_at.y, -want.max_row);
    }
    const VerticalError threads = vertical_error(mesh, posts, 1, 3);
    EXPECT_EQ(threads.rms_m, got.rms_m);
    EXPECT_EQ(threads.max_at, got.max_at);
    const VerticalError feet = vertical_error(mesh, posts, 0.3048);
    EXPECT_NEAR(feet.max_m, 0.3048 * got.max_m, 1e-9);
  }
}

TEST(VerticalErrorOverPoints, HalfASquareCoversWhatIsInItAndNothingBeside) {
  for (const double side : {0.5, 1.0, 2.0}) {
    Tin mesh;
    mesh.vertices = {{0, 0, 3}, {side, 0, 3}, {0, side, 3}};
    for (const Triangle& t : {Triangle{0, 1, 2}, {2, 1, 0}}) {
      mesh.triangles = {t};
      const VerticalError e =
          vertical_error(mesh, {{{0.25 * side, 0.25 * side, 1}, {0.75 * side, 0.75 * side, 1}}}, 1);
      EXPECT_EQ(e.posts, 1u);
      EXPECT_EQ(e.uncovered, 1u);
      EXPECT_EQ(e.max_above_m, 2);
    }
  }
}

TEST(VerticalErrorOverPoints, AsManyAsThereAreEachIsMeasured) {
  Tin slope;  // z = x
  slope.vertices = {{0, 0, 0}, {0, -10, 0}, {10, -10, 10}, {10, 0, 10}};
  slope.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const int count : {1, 2, 4095, 4096, 4097, 8192, 8193, 12289}) {
    std::vector<Vec3> points;
    double sum = 0;
    for (int i = 0; i < count; ++i) {
      const double off = 1 + i % 7;  // all of them below the mesh
      points.push_back({10.0 * i / count, -5, 10.0 * i / count - off});
      sum += off;
    }
    points.back().z -= 100;
    sum += 100;
    for (const int threads : {1, 3}) {
      const VerticalError e = vertical_error(slope, points, 1, threads);
      EXPECT_EQ(e.posts, std::uint64_t(count));
      EXPECT_NEAR(e.bias_m, sum / count, 1e-9 * sum);
      EXPECT_NEAR(e.mean_m, sum / count, 1e-9 * sum);
      EXPECT_EQ(e.max_at, points.back());
      EXPECT_NEAR(e.max_above_m, e.max_m, 1e-9);
      EXPECT_EQ(e.max_below_m, 0);
      EXPECT_NEAR(e.least_below_m, -1, 1e-9) << "not one of them is less than 1 below";
      EXPECT_TRUE(e.row_above_m.empty() && e.row_below_m.empty());
    }
  }
}

TEST(VerticalErrorOverPoints, BetweenTwoSheetsItIsTheFartherAndTheUpperOfEqualOnes) {
  Tin sheets;  // one at 10, one at -10, over each other
  for (const double z : {10.0, -10.0})
    for (const auto& [x, y] : {std::pair{0, 0}, {0, -4}, {4, -4}})
      sheets.vertices.push_back({double(x), double(y), z});
  for (const auto& triangles :
       {std::vector<Triangle>{{0, 1, 2}, {3, 4, 5}}, {{5, 4, 3}, {2, 1, 0}}}) {
    sheets.triangles = triangles;
    EXPECT_EQ(vertical_error(sheets, {{{1, -2, 0}}}, 1).bias_m, 10);
    EXPECT_EQ(vertical_error(sheets, {{{1, -2, 1}}}, 1).bias_m, -11);
    EXPECT_EQ(vertical_error(sheets, {{{1, -2, -1}}}, 1).bias_m, 11);
  }
  // A triangle without area hides nothing; nor does the slack let a sheet count that is beside.
  sheets.vertices.push_back({4, -4, 500});
  sheets.vertices.push_back({0, 0, 500});
  sheets.vertices.push_back({4, 0, 900});
  sheets.triangles = {{6, 7, 6}, {0, 1, 2}, {6, 7, 8}};
  EXPECT_EQ(vertical_error(sheets, {{{1, -1.5, 0}}}, 1).bias_m, 10);
  EXPECT_EQ(vertical_error(sheets, {{{1, -1.01, 0}}}, 1, 1, 0.1).bias_m, 10);
}

TEST(VerticalErrorOverPoints, APointOnARimCountsWhateverRoundingMakesOfItAndWhatIsBesideItDoesNot) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> in(0, 1);
  for (int round = 0; round < 300; ++round) {
    Tin mesh;  // far apart in one direction or in both
    const double w = round % 3 == 1 ? 1e-3 : 1e3, h = round % 3 == 2 ? 1e-3 : 1e3;
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back({w * in(random), h * in(random), 7});
    mesh.triangles = {{0, 1, 2}};
    const auto& v = mesh.vertices;
    if (std::fabs(orient2d(v[0], v[1], v[2])) < 1e-3 * w * h) continue;
    std::vector<Vec3> on_rims, outside;
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = v[k], &b = v[(k + 1) % 3], &other = v[(k + 2) % 3];
      for (int i = 0; i < 20; ++i) {
        const double t = in(random);
        const Vec3 p{a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), 7};
        on_rims.push_back(p);
        outside.push_back({p.x + 1e-5 * (p.x - other.x), p.y + 1e-5 * (p.y - other.y), 7});
      }
    }
    EXPECT_EQ(vertical_error(mesh, on_rims, 1).uncovered, 0u) << round;
    EXPECT_EQ(vertical_error(mesh, outside, 1).uncovered, outside.size()) << round;
  }
}

TEST(VerticalErrorOverPoints, LosesNoPointOnAnEdgeAndTakesOneJustOutsideWhereThatIsAllowed) {
  Tin mesh;
  mesh.vertices = {{0.1, 0.1, 0}, {7.3, 0.2, 0}, {5.1, 6.7, 0}, {-2.3, 5.9, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  std::vector<Vec3> on_edge;
  for (int i = 0; i <= 1000; ++i) {
    const double t = i / 1000.0;
    on_edge.push_back({0.1 + t * (5.1 - 0.1), 0.1 + t * (6.7 - 0.1), 1});
  }
  EXPECT_EQ(vertical_error(mesh, on_edge, 1).uncovered, 0u);
  const std::vector<Vec3> outside = {{7.3001, 0.2, 1}};
  EXPECT_EQ(vertical_error(mesh, outside, 1).uncovered, 1u);
  const VerticalError near = vertical_error(mesh, outside, 1, 1, 1e-3);
  EXPECT_EQ(near.uncovered, 0u);
  EXPECT_NEAR(near.max_below_m, 1, 1e-12);
}

}  // namespace
}  // namespace tind
