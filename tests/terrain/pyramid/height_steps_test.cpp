// The steps of heights go by what lies near a tile, and its neighbours know the same.

#include "terrain/pyramid/plan/height_steps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/make/make_tile.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "tests/support/layered_world.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::MadeUpSource;

constexpr double kSpacing = 1.0 / 3600;  // degrees
constexpr int kSide = 600;

TileSetOptions options() {
  TileSetOptions o;
  o.max_error_m = 0.25;
  return o;
}

/// Hills at 3,000 m, and one post far above all.
HeightGrid hills(float spike) {
  HeightGrid grid = test::rough_terrain(kSide, kSide, 7, 60);
  for (float& z : grid.values()) z += 3000;
  grid.at(150, 150) = spike;
  return grid;
}
MadeUpSource source(float spike) { return {hills(spike), {10.001, 46.001}, kSpacing}; }

TEST(HeightSteps, are_what_the_relief_and_the_error_need) {
  LevelPlan level;
  level.fit_error_m = 1;
  EXPECT_EQ(height_step(level, 0, 0), 1.0 / 16);
  EXPECT_EQ(height_step(level, 3000, 4900), 1.0 / 16) << "not how high: how far apart";
  EXPECT_EQ(height_step(level, 3000, 5100), 1.0 / 8);
  EXPECT_EQ(height_step(level, -400, 8800), 0.5);
  level.fit_error_m = 400;
  EXPECT_EQ(height_step(level, 0, 0), 1) << "no coarser than that without need";
  level.fit_error_m = 1e-4;
  EXPECT_EQ(height_step(level, 0, 0), 1.0 / 512) << "of what moves a border beside others";
}

TEST(HeightSteps, far_from_zero_are_what_floats_hold) {
  for (const auto& [height, step] : {std::pair(8848.0, 1.0 / 1024),
                                     {16'352.0, 1.0 / 1024},
                                     {16'353.0, 1.0 / 512},
                                     {200'000.0, 1.0 / 64},
                                     {kFarthestHeight_m, 1.0 / 32}}) {
    EXPECT_EQ(finest_step(height), step) << height;
    for (const double low : {height, -height})
      for (const double edge : {low, low + 32767 * step})
        EXPECT_EQ(double(float(std::floor(edge / step) * step)), std::floor(edge / step) * step);
  }
}

TEST(HeightSteps, are_coarse_beside_a_spike_only_and_the_same_from_both_sides) {
  const MadeUpSource dem = source(90000);
  const auto plan = TilePlan::make(dem, HeightRange{}, options());
  ASSERT_TRUE(plan);
  ASSERT_TRUE(plan->local_steps() && !plan->knows_range());
  const int z = plan->max_level();
  const double usual = plan->level(z).border_step_m;
  const TileArea& area = plan->tiles(z);
  int coarse = 0, between = 0;
  const auto steps = [&](std::uint32_t x, std::uint32_t y) {
    return *height_steps(dem, *plan, {z, x, y});
  };
  for (std::uint64_t i = 0; i < area.size(); ++i) {
    const auto [x, y] = area[i];
    ASSERT_FALSE(plan->rests_on_all_heights({z, x, y}));
    const HeightSteps here = steps(x, y), east = steps(x + 1, y), north = steps(x, y + 1);
    coarse += here.own > usual;
    between += here.own < here.sides[std::size_t(TileSide::east)];
    EXPECT_EQ(here.sides[std::size_t(TileSide::east)], east.sides[std::size_t(TileSide::west)]);
    EXPECT_EQ(here.ends[std::size_t(TileSide::east)], east.ends[std::size_t(TileSide::west)]);
    EXPECT_EQ(here.sides[std::size_t(TileSide::north)], north.sides[std::size_t(TileSide::south)]);
    EXPECT_EQ(here.ends[std::size_t(TileSide::north)], north.ends[std::size_t(TileSide::south)]);
    EXPECT_EQ(here.ends[std::size_t(TileSide::east)][1],
              here.ends[std::size_t(TileSide::north)][1]);
    EXPECT_EQ(here.ends[std::size_t(TileSide::south)][0],
              here.ends[std::size_t(TileSide::west)][0]);
    for (std::size_t side = 0; side < 4; ++side) {
      EXPECT_LE(here.own, here.sides[side]);
      EXPECT_LE(here.sides[side], here.ends[side][0]);
      EXPECT_LE(here.sides[side], here.ends[side][1]);
    }
  }
  EXPECT_GE(between, 1);
  // At the rim, where the ground around is 0, they are coarse without it.
  const MadeUpSource plain = source(3050);
  const auto other = TilePlan::make(plain, HeightRange{}, options());
  int without = 0;
  for (std::uint64_t i = 0; i < area.size(); ++i)
    without += height_steps(plain, *other, {z, area[i].first, area[i].second})->own > usual;
  EXPECT_GE(coarse, without + 1);
  EXPECT_LE(coarse, without + 25) << "of " << area.size();
}

/// Whether all heights are known or not, and whichever tile is first.
TEST(HeightSteps, make_the_same_tiles_before_and_after_all_heights_are_known) {
  for (const float spike : {3050.f, 9000.f}) {
    const MadeUpSource dem = source(spike);
    const auto range = read_height_range(dem);
    ASSERT_TRUE(range);
    const auto early = TilePlan::make(dem, HeightRange{}, options()),
               late = TilePlan::make(dem, *range, options());
    ASSERT_TRUE(early && late);
    int compared = 0;
    for (int z = 2; z <= early->max_level(); ++z) {
      const TileArea& area = early->tiles(z);
      for (std::uint64_t i = 0; i < area.size(); i += 7) {
        const TileId id{z, area[i].first, area[i].second};
        if (early->rests_on_all_heights(id)) continue;
        const auto a = make_tile(dem, *early, id, {}), b = make_tile(dem, *late, id, {});
        ASSERT_TRUE(a && b);
        EXPECT_EQ(a->bytes, b->bytes) << id.text();
        ++compared;
      }
    }
    EXPECT_GT(compared, 10);
  }
}

TEST(HeightSteps, differ_from_tile_to_tile_and_leave_no_crack) {
  const test::TempDir folder;
  BuildOptions o;
  o.tiles = options();
  o.tiles.effort = Effort::fast;
  o.output = folder.file("tiles");
  const Surface surface(
      std::make_shared<const MadeUpSource>(hills(4500), Geographic{10.001, 46.001}, kSpacing));
  const auto built = build_tiles(surface, o);
  ASSERT_TRUE(built) << built.error().what;
  test::expect_no_violation(o.output, surface);
}

/// Undeclared nodata of which nobody was told.
TEST(HeightSteps, a_post_that_is_no_height_is_refused_and_so_are_the_tiles_beside_it) {
  for (const float none : {-2e6f, 1e6f}) {
    const MadeUpSource dem = {hills(none), {10.001, 46.001}, kSpacing};
    const auto range = read_height_range(dem);
    ASSERT_TRUE(range);
    const auto plan = TilePlan::make(dem, *range, options());
    ASSERT_FALSE(plan);
    EXPECT_EQ(plan.error().code, Errc::bad_data);
    EXPECT_THAT(plan.error().what, testing::HasSubstr("--nodata VALUE"));
    const auto early = TilePlan::make(dem, HeightRange{}, options());
    ASSERT_TRUE(early);
    const int z = early->max_level();
    int refused = 0, made = 0;
    const TileArea& area = early->tiles(z);
    for (std::uint64_t i = 0; i < area.size(); ++i)
      ++(height_steps(dem, *early, {z, area[i].first, area[i].second}) ? made : refused);
    EXPECT_GE(refused, 1);
    EXPECT_GT(made, refused);
  }
}

}  // namespace
}  // namespace tind
