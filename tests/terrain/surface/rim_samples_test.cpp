#include "terrain/surface/rim_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "terrain/surface/post_warp.h"
#include "tests/support/made_up_source.h"

namespace tind {
namespace {

using test::MadeUpSource;
using test::rough_terrain;

constexpr double kFine = 0.002;

std::shared_ptr<const MadeUpSource> made(HeightGrid grid, Geographic corner, double spacing,
                                         double turn = 0) {
  return std::make_shared<const MadeUpSource>(std::move(grid), corner, spacing, turn);
}

struct Two {
  std::shared_ptr<const MadeUpSource> base, fine;
  Surface surface;

  explicit Two(double turn, double blend_m = -1)
      : base(made(rough_terrain(30, 30, 1), {9.5, 50.5}, 0.05)),
        fine(made(test::terrain_with_voids(100, 100, 2), {10.2, 49.8}, kFine, turn)),
        surface(*Surface::of_layers({{"base", base}, {"fine", fine, blend_m}})) {}
};

/// The tile of a level that has a place, and a place of it.
TileId tile_at(Geographic p, int level) {
  const double side = tiling::tile_degrees(level);
  return *tiling::tile(std::uint32_t(level), std::uint32_t((p.lon + 180) / side),
                       std::uint32_t((p.lat + 90) / side));
}
Geographic place(TileId t, const Vec3& p) {
  const GeoRect r = tiling::rect(t);
  return {r.west + p.x / kTileExtent * r.width(), r.south + p.y / kTileExtent * r.height()};
}

TEST(RimSamples, are_h_where_a_lower_layer_decides_beside_an_upper_one) {
  for (const double turn : {0.0, 0.2}) {
    const Two two(turn);
    const HeightField field(two.surface);
    for (const int level : {5, 8, 11}) {
      const TileId tile = tile_at({10.2, 49.79}, level);
      const auto samples = rim_samples(field, tile);
      ASSERT_TRUE(samples);
      EXPECT_GT(samples->size(), 10u) << level;
      for (const Vec3& s : *samples) {
        EXPECT_TRUE(s.x >= 0 && s.y >= 0 && s.x <= kTileExtent && s.y <= kTileExtent);
        const Geographic p = place(tile, s);
        double h = 0;
        int deciding = -1;
        field.at({&p, 1}, {&h, 1}, {&deciding, 1});
        EXPECT_EQ(deciding, 0);
        EXPECT_NEAR(h, s.z, 1e-4);
        EXPECT_TRUE(two.surface.reaches(1, {p.lon, p.lat, p.lon, p.lat}));
      }
    }
  }
}

TEST(RimSamples, leave_no_gap_in_the_blend) {
  const Two two(0.2);
  const HeightField field(two.surface);
  const TileId tile = tile_at({10.2, 49.79}, 9);
  const auto samples = rim_samples(field, tile);
  ASSERT_TRUE(samples);
  // Places a quarter of the blend out of the western side, and in the stripe of voids.
  const double out = two.surface.layers()[1].blend_m / 4 / two.fine->info().spacing_x_m;
  std::vector<Vec2> posts;
  for (int row = 40; row < 90; row += 5)
    posts.push_back({-out, double(row)}), posts.push_back({52, row + 0.5});
  std::vector<Geographic> places(posts.size());
  two.fine->to_geographic(posts, places);
  const GeoRect rect = tiling::rect(tile);
  const double post = kFine / rect.width() * kTileExtent;  // units of the tile's grid
  for (const Geographic& p : places) {
    const double u = (p.lon - rect.west) / rect.width() * kTileExtent,
                 v = (p.lat - rect.south) / rect.height() * kTileExtent;
    if (u < 0 || v < 0 || u > kTileExtent || v > kTileExtent) continue;
    const bool near = std::ranges::any_of(*samples, [&](const Vec3& s) {
      return std::hypot(s.x - u, s.y - v) < 4 * std::sqrt(2.0) * post;
    });
    EXPECT_TRUE(near) << p.lon << " " << p.lat;
  }
}

TEST(RimSamples, there_are_none_of_one_dem_nor_where_nothing_is_bent) {
  const Two bent(0), not_bent(0, 0);
  const TileId there = tile_at({10.2, 49.79}, 9), far = tile_at({9.6, 49.2}, 11);
  EXPECT_TRUE(rim_samples(HeightField(bent.base), there)->empty());
  EXPECT_TRUE(rim_samples(HeightField(not_bent.surface), there)->empty());
  EXPECT_TRUE(rim_samples(HeightField(bent.surface), far)->empty());
  EXPECT_FALSE(rim_samples(HeightField(bent.surface), there)->empty());
}

TEST(RimSamples, a_read_error_is_one) {
  const Two two(0.2);
  two.fine->reads_left = 0;
  EXPECT_FALSE(rim_samples(HeightField(two.surface), tile_at({10.2, 49.79}, 9)));
}

}  // namespace
}  // namespace tind
