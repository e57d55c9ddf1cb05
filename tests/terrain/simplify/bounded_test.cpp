// The promises of `bounded` and `greedy`: the bound over every post, nothing flipped or uncovered,
// on real, rough and degenerate terrain; the same mesh for any number of threads.

#include "terrain/simplify/bounded/bounded.h"

#include <gtest/gtest.h>

#include <random>

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/raster/dem_source.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::grid_from;
using test::rough_terrain;

Simplified run(const HeightGrid& grid, const std::string& method, double max_error,
               Effort effort = Effort::normal, Side side = Side::both, int threads = 1) {
  SimplifyOptions o;
  o.method = *method_named(method);
  if (auto* const bounded = std::get_if<BoundedOptions>(&o.method)) *bounded = {effort, side};
  o.stop.max_error_m = max_error;
  o.threads = threads;
  auto result = simplify({grid, 30, 30}, o);
  if (!result) throw std::runtime_error(result.error().what);
  return *result;
}

void expect_promises(const HeightGrid& grid, const Simplified& s, double above, double below) {
  const MeshValidity v = check_validity(s.tin);
  EXPECT_TRUE(v.ok()) << v.first_problem;
  EXPECT_DOUBLE_EQ(v.area, double(grid.cols() - 1) * (grid.rows() - 1));
  const VerticalError e = vertical_error(s.tin, grid);
  EXPECT_EQ(e.uncovered, 0u);
  EXPECT_LE(e.max_above_m, above);
  EXPECT_LE(e.max_below_m, below);
}

TEST(Bounded, keeps_the_bound_at_every_effort_with_ever_fewer_triangles) {
  const HeightGrid grid = rough_terrain(300, 220, 1);
  std::size_t before = run(grid, "greedy", 5).tin.triangles.size();
  for (const Effort effort : {Effort::fast, Effort::normal, Effort::best}) {
    const Simplified s = run(grid, "bounded", 5, effort);
    expect_promises(grid, s, 5, 5);
    EXPECT_LT(s.tin.triangles.size(), before) << name_of(effort);
    before = s.tin.triangles.size();
  }
}

TEST(Bounded, one_sided_meshes_stay_on_their_side) {
  const HeightGrid grid = rough_terrain(200, 200, 2);
  expect_promises(grid, run(grid, "bounded", 8, Effort::normal, Side::above), 8, 1e-9);
  expect_promises(grid, run(grid, "bounded", 8, Effort::normal, Side::below), 1e-9, 8);
}

TEST(Bounded, many_blocks_are_one_mesh_and_threads_do_not_show) {
  const HeightGrid grid = rough_terrain(1100, 500, 3);
  const Simplified one = run(grid, "bounded", 20, Effort::normal, Side::both, 1);
  expect_promises(grid, one, 20, 20);
  EXPECT_GT(one.details.at("blocks"), 1);
  const Simplified three = run(grid, "bounded", 20, Effort::normal, Side::both, 3);
  EXPECT_EQ(one.tin.vertices, three.tin.vertices);
  EXPECT_EQ(one.tin.triangles, three.tin.triangles);
}

TEST(Bounded, rows_of_blocks_are_one_mesh_however_many_are_made_at_once) {
  // 2 x 4 blocks, one row of them without any valid post, and posts missing at block corners.
  HeightGrid grid = rough_terrain(1000, 2060, 8, 300);
  for (int r = 1000; r < 1560; ++r)
    for (int c = 0; c < 1000; ++c) grid.at(c, r) = HeightGrid::kVoid;
  grid.at(499, 514) = grid.at(499, 515) = grid.at(500, 515) = HeightGrid::kVoid;
  for (const Effort effort : {Effort::fast, Effort::normal}) {
    const Simplified one = run(grid, "bounded", 60, effort, Side::both, 1);
    expect_promises(grid, one, 60, 60);
    for (const int threads : {2, 7}) {
      const Simplified more = run(grid, "bounded", 60, effort, Side::both, threads);
      EXPECT_EQ(one.tin.vertices, more.tin.vertices) << threads;
      EXPECT_EQ(one.tin.triangles, more.tin.triangles) << threads;
    }
  }
  // So coarse that nearly every triangle crosses a seam.
  expect_promises(grid, run(grid, "bounded", 200, Effort::normal), 200, 200);
}

TEST(Bounded, a_failed_read_is_an_error) {
  RunOptions o;
  o.stop.max_error_m = 5;
  const HeightRows broken{600, 2000, [](int first, int count) -> Result<HeightGrid> {
                            if (first > 600) return fail(Errc::io, "the disk is gone");
                            return HeightGrid(600, count, 1);
                          }};
  const auto s = simplify_bounded_rows(broken, 30, 30, {}, o, {});
  ASSERT_FALSE(s);
  EXPECT_EQ(s.error().what, "the disk is gone");
}

TEST(GridSamples, one_that_is_outside_a_band_is_not_held_back_along_a_long_row) {
  constexpr int kCols = 30'000;
  for (const double slope : {0.0, 0.0377, -1.31}) {
    HeightGrid grid(kCols, 2);
    for (int c = 0; c < kCols; ++c) grid.at(c, 0) = grid.at(c, 1) = float(4000 + slope * c);
    GridSamples samples;
    samples.cols = kCols, samples.rows = 2, samples.z = grid.values().data();
    const double end = kCols - 1;
    const Band band{0, 0, 4000, 1, slope, 0, -1, slope, 0, std::abs(slope * end) + 1};
    for (int c = 1000; c < kCols - 1000; c += 997) {
      const float before = grid.at(c, 0);
      grid.at(c, 0) += c % 2 ? 1.02f : -1.02f;  // by 2 cm: float itself keeps 4 mm
      bool seen = false;
      samples.scan_outside({0, 0, 0}, {end / 2, -1, 0}, {end, 0, 0}, band,
                           [&](double, double, double, std::size_t k) {
                             seen |= k == std::size_t(c);
                             return true;
                           });
      EXPECT_TRUE(seen) << slope << " at " << c;
      grid.at(c, 0) = before;
    }
  }
}

TEST(Bounded, degenerate_terrain) {
  std::mt19937 random(4);
  std::vector<HeightGrid> grids = {
      grid_from("0 0 / 0 0"), grid_from("0 9 / 9 0"), grid_from("1 2 3 / 9 9 9 / 0 0 0"),
      grid_from("0 . 0 / . 5 . / 0 . 0"), grid_from(". . 1 / . . 2 / 3 4 5")};
  HeightGrid checkers(33, 31), spikes(40, 40, 0), steps(64, 20), plane(50, 50), bowl(50, 50);
  for (int r = 0; r < 31; ++r)
    for (int c = 0; c < 33; ++c) checkers.at(c, r) = (c + r) % 2 ? 100.f : -100.f;
  for (int k = 0; k < 60; ++k) spikes.at(int(random() % 40), int(random() % 40)) = 8000;
  for (int r = 0; r < 20; ++r)
    for (int c = 0; c < 64; ++c) steps.at(c, r) = float(c / 16 * 500);
  for (int r = 0; r < 50; ++r)
    for (int c = 0; c < 50; ++c) {
      plane.at(c, r) = float(3 * c - 2 * r);
      bowl.at(c, r) = float(c * c + r * r);
      if ((c - 25) * (c - 25) + (r - 25) * (r - 25) < 80) plane.at(c, r) = HeightGrid::kVoid;
    }
  for (const auto& g : {checkers, spikes, steps, plane, bowl}) grids.push_back(g);
  for (int k = 0; k < 40; ++k) grids.push_back(test::terraced_grid(random, 9, 9, 7, 10));
  for (const HeightGrid& grid : grids) {
    for (const double eps : {0.01, 5.0, 1e4}) {
      expect_promises(grid, run(grid, "bounded", eps), eps, eps);
      expect_promises(grid, run(grid, "bounded", eps, Effort::best, Side::above), eps, 1e-9);
      expect_promises(grid, run(grid, "greedy", eps), eps + 1e-9, eps + 1e-9);
    }
  }
}

TEST(Bounded, no_vertex_flies_off_between_posts_or_over_voids) {
  HeightGrid grid = rough_terrain(160, 160, 7, 2000);
  for (int r = 60; r < 75; ++r)
    for (int c = 80; c < 110; ++c) grid.at(c, r) = HeightGrid::kVoid;
  float low = 1e9f, high = -1e9f;
  for (const float z : grid.values())
    if (!std::isnan(z)) low = std::min(low, z), high = std::max(high, z);
  for (const Effort effort : {Effort::fast, Effort::normal, Effort::best}) {
    const Simplified s = run(grid, "bounded", 3, effort);
    for (const Vec3& v : s.tin.vertices) {
      // Near its posts, and not only within the range of the whole grid.
      float near_low = high, near_high = low;
      for (int r = int(-v.y) - 12; r <= int(-v.y) + 12; ++r) {
        for (int c = int(v.x) - 12; c <= int(v.x) + 12; ++c) {
          if (!grid.inside(c, r) || grid.is_void(c, r)) continue;
          near_low = std::min(near_low, grid.at(c, r));
          near_high = std::max(near_high, grid.at(c, r));
        }
      }
      EXPECT_GE(v.z, near_low - 3) << name_of(effort) << " at " << v.x << "," << v.y;
      EXPECT_LE(v.z, near_high + 3) << name_of(effort) << " at " << v.x << "," << v.y;
    }
  }
}

TEST(Bounded, a_plane_is_two_triangles) {
  HeightGrid plane(80, 60);
  for (int r = 0; r < 60; ++r)
    for (int c = 0; c < 80; ++c) plane.at(c, r) = float(2 * c + r);
  EXPECT_EQ(run(plane, "bounded", 0.5).tin.triangles.size(), 2u);
  EXPECT_EQ(run(plane, "greedy", 0.5).tin.triangles.size(), 2u);
}

Simplified run_count(const HeightGrid& grid, const std::string& method, std::uint64_t triangles,
                     Effort effort = Effort::normal, Side side = Side::both) {
  SimplifyOptions o;
  o.method = *method_named(method);
  if (auto* const bounded = std::get_if<BoundedOptions>(&o.method)) *bounded = {effort, side};
  o.stop.triangles = triangles;
  auto result = simplify({grid, 30, 30}, o);
  if (!result) throw std::runtime_error(result.error().what);
  return *result;
}

TEST(Bounded, a_count_is_met_from_below) {
  const HeightGrid grid = rough_terrain(200, 150, 5);
  for (const Side side : {Side::both, Side::above}) {
    const Simplified s = run_count(grid, "bounded", 3000, Effort::normal, side);
    EXPECT_LE(s.tin.triangles.size(), 3000u) << name_of(side);
    EXPECT_GE(s.tin.triangles.size(), 2900u) << name_of(side);
    EXPECT_EQ(s.note, "");
  }
}

TEST(Bounded, a_small_count_for_one_side_is_met_as_nearly_as_a_large_one) {
  const HeightGrid grid = rough_terrain(300, 260, 8, 2000);
  for (const std::uint64_t count : {1000, 300, 100}) {
    const Simplified s = run_count(grid, "bounded", count, Effort::fast, Side::above);
    EXPECT_LE(s.tin.triangles.size(), count);
    EXPECT_GE(double(s.tin.triangles.size()), 0.95 * double(count));
    if (s.tin.triangles.size() < 0.99 * double(count)) {
      EXPECT_NE(s.note.find("search"), std::string::npos) << s.note;
    }
  }
}

TEST(Bounded, a_count_has_less_rms_than_quadrics_and_less_maximum_than_insertion) {
  const std::vector<std::string> files = {test::testdata("bigtujunga_crop.tif")};
  const auto source = DemSource::open(files);
  ASSERT_TRUE(source);
  const DemInfo& info = (*source)->info();
  const auto grid = (*source)->read(0, 0, int(info.cols), int(info.rows));
  ASSERT_TRUE(grid);
  for (const std::uint64_t count : {1000, 10000}) {
    const VerticalError insertion = vertical_error(run_count(*grid, "greedy", count).tin, *grid);
    double before = vertical_error(run_count(*grid, "memoryless", count).tin, *grid).rms_m;
    for (const Effort effort : {Effort::fast, Effort::normal, Effort::best}) {
      const Simplified s = run_count(*grid, "bounded", count, effort);
      expect_promises(*grid, s, insertion.max_m + 1e-6, insertion.max_m + 1e-6);
      const double rms = vertical_error(s.tin, *grid).rms_m;
      EXPECT_LT(rms, before) << name_of(effort) << " at " << count;
      before = rms;
    }
  }
}

TEST(Bounded, a_count_on_degenerate_terrain) {
  std::mt19937 random(6);
  std::vector<HeightGrid> grids = {HeightGrid(2, 2, 1), HeightGrid(40, 3, 7), HeightGrid(30, 30)};
  for (int r = 0; r < 30; ++r)
    for (int c = 0; c < 30; ++c) grids[2].at(c, r) = float(c * c + r);
  for (int k = 0; k < 40; ++k) grids.push_back(test::terraced_grid(random, 20, 5, 3, 1000));
  for (const HeightGrid& grid : grids) {
    for (const std::uint64_t count : {2, 7, 60, 5000}) {
      const Simplified s = run_count(grid, "bounded", count);
      EXPECT_LE(s.tin.triangles.size(), count);
      expect_promises(grid, s, 5000, 5000);
    }
  }
}

TEST(Bounded, real_terrain_far_below_greedy) {
  const std::vector<std::string> files = {test::testdata("bigtujunga_crop.tif")};
  const auto source = DemSource::open(files);
  ASSERT_TRUE(source);
  const DemInfo& info = (*source)->info();
  const auto grid = (*source)->read(0, 0, int(info.cols), int(info.rows));
  ASSERT_TRUE(grid);
  const Simplified s = run(*grid, "bounded", 5);
  expect_promises(*grid, s, 5, 5);
  EXPECT_LT(double(s.tin.triangles.size()),
            0.45 * double(run(*grid, "greedy", 5).tin.triangles.size()));
}

}  // namespace
}  // namespace tind
