// The surface that normals of coarse tiles come from: what the records say, the same for
// whoever asks.

#include "terrain/pyramid/residual/indexed_heights.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::MadeUpSource;
using test::TempDir;

std::shared_ptr<const ResidualIndex> index_of(const MadeUpSource& source, const TempDir& dir,
                                              int level) {
  auto index = ResidualIndex::open_or_make(dir.file("index"), source, level, 1);
  EXPECT_TRUE(index) << index.error().what;
  return index ? *index : nullptr;
}

std::vector<double> heights_of(IndexedHeights& heights, const std::vector<Geographic>& places) {
  std::vector<double> h(places.size());
  heights.at(places, h);
  EXPECT_FALSE(heights.error());
  return h;
}

/// Asks at the nodes of a tile's lattice and at the middles of its cells.
void expect_as_the_lattice(const ResidualIndex& index, TileId id) {
  SCOPED_TRACE(id.text());
  const auto lattice = index.lattice(id);
  ASSERT_TRUE(lattice);
  IndexedHeights heights(index, id.level);
  const GeoRect rect = tiling::rect(id);
  const double cell = rect.width() / lattice->cells;
  std::vector<Geographic> places;
  std::vector<double> wanted;
  for (int row = 0; row < lattice->cells; ++row)
    for (int col = 0; col < lattice->cells; ++col) {
      const bool has_post = lattice->residual[std::size_t(row * lattice->cells + col)] >= 0;
      const auto node = [&](int i, int j) {
        return double(lattice->heights[std::size_t((row + j) * lattice->nodes() + col + i)]);
      };
      places.push_back({rect.west + (col + 0.5) * cell, rect.north - (row + 0.5) * cell});
      // On the cut, which runs from the south-west to the north-east.
      wanted.push_back(has_post ? (node(0, 1) + node(1, 0)) / 2 : NAN);
      if (!has_post) continue;
      places.push_back({rect.west + col * cell, rect.north - row * cell});
      wanted.push_back(node(0, 0));
      places.push_back({rect.west + (col + 1) * cell, rect.north - (row + 1) * cell});
      wanted.push_back(node(1, 1));
    }
  const auto got = heights_of(heights, places);
  std::size_t valid = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    ASSERT_EQ(std::isnan(got[i]), std::isnan(wanted[i])) << i;
    if (std::isnan(wanted[i])) continue;
    ASSERT_NEAR(got[i], wanted[i], 1e-3) << i;  // nodes of the lattice are floats
    ++valid;
  }
  EXPECT_GT(valid, 0u);
}

TEST(IndexedHeights, are_the_lattice_of_each_level) {
  const TempDir dir;
  const MadeUpSource source(test::terrain_with_voids(620, 500, 1), {10.123, 45.9}, 0.00131);
  const auto index = index_of(source, dir, 9);
  ASSERT_TRUE(index);
  expect_as_the_lattice(*index, {8, 270, 193});
  expect_as_the_lattice(*index, {7, 135, 96});
  expect_as_the_lattice(*index, {3, 8, 6});
}

TEST(IndexedHeights, do_not_depend_on_what_was_asked_before) {
  const TempDir dir;
  const MadeUpSource source(test::terrain_with_voids(620, 500, 1), {10.123, 45.9}, 0.00131);
  const auto index = index_of(source, dir, 9);
  ASSERT_TRUE(index);
  std::vector<Geographic> places;
  for (int i = 0; i < 200; ++i)  // across the sides of tiles, and along one: 10.546875 east
    for (int k = 0; k < 40; ++k)
      places.push_back({k == 0 ? 10.546875 : 10.1 + 0.021 * k, 45.1 + 0.005 * i});
  IndexedHeights one(*index, 8);
  const auto together = heights_of(one, places);
  std::size_t valid = 0;
  for (std::size_t i = places.size(); i-- > 0;) {
    IndexedHeights alone(*index, 8);
    const auto h = heights_of(i % 7 == 0 ? alone : one, {places[i]});
    EXPECT_TRUE(h[0] == together[i] || (std::isnan(h[0]) && std::isnan(together[i]))) << i;
    valid += !std::isnan(h[0]);
  }
  EXPECT_GT(valid, places.size() / 4);
  EXPECT_LT(valid, places.size());
}

TEST(IndexedHeights, where_the_data_ends_on_a_line_of_cells_the_line_has_them) {
  const TempDir dir;
  // Posts on lines of cells of level 9, whose side is 0.3515625 degrees; the last ones on sides.
  const double spacing = tiling::tile_degrees(9) / 256;
  const MadeUpSource source(HeightGrid(257, 257, 30.0F), {10.546875, 45}, spacing);
  const auto index = index_of(source, dir, 9);
  ASSERT_TRUE(index);
  const double east = 10.546875 + 256 * spacing, south = 45 - 256 * spacing;
  IndexedHeights heights(*index, 8);
  const auto h = heights_of(heights, {{east, 44.9},
                                      {east, 45},
                                      {10.546875, 45},
                                      {10.6, south},
                                      {east, south},
                                      {10.6, 46},
                                      {-170, -45},
                                      {10.6, 44.9}});
  for (const int i : {0, 1, 2, 3, 4, 7}) EXPECT_NEAR(h[std::size_t(i)], 30, 0.05) << i;
  EXPECT_TRUE(std::isnan(h[5]));
  EXPECT_TRUE(std::isnan(h[6]));
}

TEST(IndexedHeights, longitudes_go_on_past_180_and_latitudes_end_at_the_poles) {
  const TempDir dir;
  // The last columns are east of 180 degrees.
  const MadeUpSource source(HeightGrid(40, 30, 12.0F), {179.5, 90}, 0.01);
  const auto index = index_of(source, dir, 5);
  ASSERT_TRUE(index);
  IndexedHeights heights(*index, 3);
  const auto h =
      heights_of(heights, {{179.6, 89.9}, {179.6 - 360, 89.9}, {179.6, 90}, {-180.2, 89.9}});
  EXPECT_NEAR(h[0], 12, 0.5);
  EXPECT_EQ(h[1], h[0]);
  EXPECT_NEAR(h[2], 12, 0.5);
  EXPECT_NEAR(h[3], 12, 0.5);
}

}  // namespace
}  // namespace tind
