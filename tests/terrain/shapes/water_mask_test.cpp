#include "terrain/shapes/water_mask.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <set>

#include "tests/support/made_up_source.h"
#include "tests/support/text_dem.h"

namespace tind {
namespace {

using test::MadeUpSource;
using Mask = std::vector<std::uint8_t>;

WaterSource polygon(std::vector<Vec2> points) {
  std::vector<AreaSet::Edge> edges;
  for (std::size_t i = 0; i < points.size(); ++i)
    edges.push_back({points[i], points[(i + 1) % points.size()], 0});
  return {AreaSet(std::move(edges)), {}};
}

Mask mask_of(const WaterSource& water, const GeoRect& r) {
  auto mask = water_mask(water, r);
  EXPECT_TRUE(mask);
  return mask.value_or(Mask{});
}

TEST(WaterMask, is_one_byte_where_it_is_uniform) {
  const WaterSource square = polygon({{0, 0}, {10, 0}, {10, 10}, {0, 10}});
  EXPECT_EQ(mask_of(square, {4, 4, 5, 5}), Mask{255});
  EXPECT_EQ(mask_of(square, {40, 4, 41, 5}), Mask{0});
  EXPECT_EQ(mask_of({}, {4, 4, 5, 5}), Mask{0});
}

TEST(WaterMask, has_the_north_first_and_goes_from_west_to_east) {
  const Mask mask = mask_of(polygon({{0, 0.5}, {0.25, 0.5}, {0.25, 2}, {0, 2}}), {0, 0, 1, 1});
  ASSERT_EQ(mask.size(), 65536u);
  EXPECT_EQ(mask[0], 255);  // north-west
  EXPECT_EQ(mask[63], 255);
  EXPECT_EQ(mask[64], 0);  // east of it
  EXPECT_EQ(mask[127 * 256], 255);
  EXPECT_EQ(mask[128 * 256], 0);  // south of the middle
}

TEST(WaterMask, says_which_share_of_a_cell_is_water) {
  // A shore in the middle of a column of cells, and one a quarter down a row of them.
  const double cell = 1.0 / 256;
  const Mask mask =
      mask_of(polygon({{-1, 0.25 * cell}, {10.5 * cell, 0.25 * cell}, {10.5 * cell, 3}, {-1, 3}}),
              {0, 0, 1, 1});
  ASSERT_EQ(mask.size(), 65536u);
  EXPECT_EQ(mask[9], 255);
  EXPECT_EQ(mask[10], 128);
  EXPECT_EQ(mask[11], 0);
  EXPECT_EQ(mask[255 * 256 + 5], 191);  // three quarters
}

TEST(WaterMask, of_an_area_is_the_area) {
  std::vector<Vec2> circle;
  for (int k = 0; k < 720; ++k)
    circle.push_back({0.5 + 0.3 * std::cos(k * M_PI / 360), 0.5 + 0.3 * std::sin(k * M_PI / 360)});
  const Mask mask = mask_of(polygon(circle), {0, 0, 1, 1});
  const double sum = std::accumulate(mask.begin(), mask.end(), 0.0) / 255 / 65536;
  EXPECT_NEAR(sum, M_PI * 0.09, 1e-4);
}

TEST(WaterMask, overlapping_waters_count_once_and_islands_are_dry) {
  WaterSource water;
  std::vector<AreaSet::Edge> edges;
  const auto square = [&](double a, double b, std::uint32_t polygon) {
    const std::vector<Vec2> p{{a, a}, {b, a}, {b, b}, {a, b}};
    for (std::size_t i = 0; i < 4; ++i) edges.push_back({p[i], p[(i + 1) % 4], polygon});
  };
  square(0.125, 0.75, 0), square(0.25, 0.5, 0);  // with an island
  square(0.625, 0.875, 1);
  water.areas = AreaSet(std::move(edges));
  const Mask mask = mask_of(water, {0, 0, 1, 1});
  const auto at = [&](double lon, double lat) {
    return mask[std::size_t((1 - lat) * 256) * 256 + std::size_t(lon * 256)];
  };
  EXPECT_EQ(at(0.2, 0.2), 255);
  EXPECT_EQ(at(0.4, 0.4), 0);
  EXPECT_EQ(at(0.7, 0.7), 255);  // in both
  EXPECT_EQ(at(0.8, 0.8), 255);
  EXPECT_EQ(at(0.9, 0.9), 0);
}

TEST(WaterMask, of_a_raster_is_where_it_is_valid_and_not_zero) {
  HeightGrid grid(32, 32);
  for (int r = 0; r < 32; ++r)
    for (int c = 0; c < 32; ++c) grid.at(c, r) = c < 8 ? 1 : c < 16 ? 0 : HeightGrid::kVoid;
  WaterSource water;
  // Posts at the middle of 1/32 of a degree each.
  water.rasters.push_back(
      std::make_shared<MadeUpSource>(grid, Geographic{1.0 / 64, 1 - 1.0 / 64}, 1.0 / 32));
  const Mask mask = mask_of(water, {0, 0, 1, 1});
  ASSERT_EQ(mask.size(), 65536u);
  EXPECT_EQ(mask[100 * 256 + 63], 255);
  EXPECT_EQ(mask[100 * 256 + 64], 0);
  EXPECT_EQ(mask[100 * 256 + 200], 0);
  EXPECT_EQ(mask_of(water, {0, 0, 0.125, 0.125}), Mask{255});
  EXPECT_EQ(mask_of(water, {50, 50, 51, 51}), Mask{0});
}

TEST(WaterMask, of_a_raster_has_no_water_opposite_of_it) {
  // Water from 10 W to 100 E, of two degrees a post, in tiles of half a globe.
  WaterSource water;
  const test::TempDir folder;
  water.rasters.push_back(test::text_dem(folder, "water", HeightGrid(56, 21, 1), {-10, -20}, 2));
  const auto wet = [&](const GeoRect& r) {
    const Mask mask = mask_of(water, r);
    EXPECT_EQ(mask.size(), 65536u);
    std::set<int> columns;
    for (std::size_t i = 0; i < mask.size(); ++i)
      if (mask[i]) columns.insert(int(i % 256));
    return columns;
  };
  const auto west = wet({-180, -90, 0, 90}), east = wet({0, -90, 180, 90});
  EXPECT_NEAR(*west.begin(), 256 * (180 - 11) / 180., 1);
  EXPECT_EQ(*west.rbegin(), 255);
  EXPECT_EQ(*east.begin(), 0);
  EXPECT_NEAR(*east.rbegin(), 256 * 101 / 180., 1);
}

}  // namespace
}  // namespace tind
