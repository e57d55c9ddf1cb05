#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "terrain/surface/height_field.h"
#include "terrain/surface/open_surface.h"
#include "terrain/surface/surface.h"
#include "terrain/surface/tile_posts.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::MadeUpSource;
using test::rough_terrain;

constexpr double kBase = 0.01, kFine = 0.002;

std::shared_ptr<const MadeUpSource> made(HeightGrid grid, Geographic corner, double spacing,
                                         double turn = 0) {
  return std::make_shared<const MadeUpSource>(std::move(grid), corner, spacing, turn);
}

/// 60 x 60 coarse posts, and 100 x 100 fine ones with voids, turned, 300 m higher, in the middle.
struct Two {
  std::shared_ptr<const MadeUpSource> base, fine;
  Surface surface;

  explicit Two(double blend_m = -1, double turn = 0.2)
      : base(made(rough_terrain(60, 60, 1), {10, 50}, kBase)),
        fine(made(
            [] {
              HeightGrid grid = test::terrain_with_voids(100, 100, 2);
              for (float& z : grid.values()) z += 300;
              return grid;
            }(),
            {10.2, 49.8}, kFine, turn)),
        surface(*Surface::of_layers({{"base", base}, {"fine", fine, blend_m}})) {}
};

std::vector<Geographic> posts_of(const MadeUpSource& source) {
  std::vector<Vec2> posts;
  for (int r = 0; r < source.info().rows; ++r)
    for (int c = 0; c < source.info().cols; ++c) posts.push_back({double(c), double(r)});
  std::vector<Geographic> places(posts.size());
  source.to_geographic(posts, places);
  return places;
}

TEST(Layers, valid_posts_of_a_higher_layer_keep_their_heights) {
  const Two two;
  const HeightField field(two.surface);
  const auto places = posts_of(*two.fine);
  std::vector<double> h(places.size()), filled(places.size());
  std::vector<int> deciding(places.size());
  field.at(places, h, deciding);
  field.filled(places, filled);
  std::size_t valid = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const float z = two.fine->grid().values()[i];
    EXPECT_EQ(deciding[i], std::isnan(z) ? 0 : 1);
    if (std::isnan(z)) continue;
    ++valid;
    EXPECT_EQ(h[i], double(z));
    EXPECT_EQ(filled[i], double(z));
  }
  EXPECT_GT(valid, 5000u);
  ASSERT_FALSE(field.error());
}

// What caches, ETags and records of builds tell two surfaces apart by.
TEST(Layers, fingerprint_changes_with_all_that_makes_the_heights) {
  const std::vector<LayerSpec> two = {{"low", {test::testdata("rainier.tif")}},
                                      {"high", {test::testdata("desert.asc")}}};
  const auto print = [](std::vector<LayerSpec> layers, SurfaceOptions options = {}) {
    const auto surface = open_surface(layers, options);
    EXPECT_TRUE(surface) << surface.error().what;
    return surface ? surface->info().fingerprint : std::string();
  };
  std::vector<std::string> prints = {print(two), print({two[1], two[0]})};
  EXPECT_EQ(print(two), prints[0]);
  prints.push_back(print(two, {.dem = {}, .blend_m = 200}));
  prints.push_back(print(two, {.dem = {}, .blends_m = {{"high", 100}}}));
  prints.push_back(print(two, {.dem = {}, .blends_m = {{"high", 0}}}));
  prints.push_back(print(two, {.dem = {}, .max_errors_m = {{"low", 30}}}));
  auto other = two;
  other[1].dem = DemOptions{};
  other[1].dem->nodata = {1000};
  prints.push_back(print(other));
  prints.push_back(print({two[0]}));
  prints.push_back(print({two[0], two[1], {"again", {test::testdata("bigtujunga_crop.tif")}}}));
  const std::set<std::string> different(prints.begin(), prints.end());
  EXPECT_EQ(different.size(), prints.size()) << testing::PrintToString(prints);
}

/// Steps of 1e-6 degrees along lines across rims and voids: no jump that is not a slope.
void expect_continuous(const Surface& surface, double west, double east, double south, double north,
                       double steepest) {
  const HeightField field(surface);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> x(west, east), y(south, north);
  constexpr int kLines = 40, kSteps = 4000;
  std::vector<Geographic> places(kSteps);
  std::vector<double> h(kSteps);
  double worst = 0;
  for (int n = 0; n < kLines; ++n) {
    const Geographic a{x(random), y(random)}, b{x(random), y(random)};
    for (int i = 0; i < kSteps; ++i) {
      const double t = double(i) / kSteps;
      places[std::size_t(i)] = {a.lon + t * (b.lon - a.lon), a.lat + t * (b.lat - a.lat)};
    }
    field.filled(places, h);
    for (int i = 0; i + 1 < kSteps; ++i) {
      const Geographic &p = places[std::size_t(i)], &q = places[std::size_t(i) + 1];
      const double gap = std::abs(h[std::size_t(i) + 1] - h[std::size_t(i)]);
      if (gap <= steepest * std::hypot(q.lon - p.lon, q.lat - p.lat)) continue;
      // Steep, or a step? Halve the way until it is short.
      Geographic lo = p, hi = q;
      double at_lo = h[std::size_t(i)], at_hi = h[std::size_t(i) + 1];
      for (int k = 0; k < 30; ++k) {
        const Geographic mid{(lo.lon + hi.lon) / 2, (lo.lat + hi.lat) / 2};
        double z = 0;
        field.filled({&mid, 1}, {&z, 1});
        if (std::abs(z - at_lo) > std::abs(at_hi - z))
          hi = mid, at_hi = z;
        else
          lo = mid, at_lo = z;
      }
      worst = std::max(worst, std::abs(at_hi - at_lo));
    }
  }
  EXPECT_LT(worst, 1e-3);
}

TEST(Layers, h_has_no_step_at_rims_nor_at_voids) {
  for (const double turn : {0.0, 0.2}) {
    const Two two(-1, turn);
    expect_continuous(two.surface, 10.1, 10.5, 49.5, 49.9, 1e5);
  }
}

TEST(Layers, a_rim_goes_on_alike_whether_it_runs_along_rows_or_columns) {
  // On the equator, and the same when mirrored at its diagonal.
  HeightGrid grid = rough_terrain(100, 100, 5, 300);
  for (int r = 0; r < 100; ++r)
    for (int c = 0; c < r; ++c) grid.at(c, r) = grid.at(r, c);
  const auto base = made(HeightGrid(60, 60, 100.f), {10, 0.3}, kBase);
  const auto fine = made(std::move(grid), {10.2, 0.1}, kFine);
  const auto surface = Surface::of_layers({{"base", base}, {"fine", fine}});
  ASSERT_TRUE(surface);
  const HeightField field(*surface);
  for (const double out : {1.0, 3.0, 6.5})
    for (int k = 0; k < 100; ++k) {
      const std::vector<Vec2> posts = {{double(k), -out}, {-out, double(k)}};
      std::vector<Geographic> places(2);
      fine->to_geographic(posts, places);
      std::vector<double> h(2);
      field.at(places, h);
      EXPECT_NEAR(h[0], h[1], 0.01) << k << " " << out;
    }
}

TEST(Layers, without_blending_there_is_a_step) {  // else the test above sees nothing
  const Two two(0, 0);
  const HeightField field(two.surface);
  double worst = 0;
  for (int i = 0; i < 90; ++i) {
    const double lat = 49.79 - 0.002 * i;
    const std::vector<Geographic> places = {{10.2 - 1e-7, lat}, {10.2 + 1e-7, lat}};
    std::vector<double> h(2);
    field.filled(places, h);
    worst = std::max(worst, std::abs(h[1] - h[0]));
  }
  EXPECT_GT(worst, 20);
}

TEST(Layers, a_finer_layer_below_a_coarser_one_has_no_step_either) {
  const auto fine = made(rough_terrain(200, 200, 4), {10, 50}, kFine);
  HeightGrid grid = test::terrain_with_voids(12, 12, 5);
  const auto coarse = made(std::move(grid), {10.1, 49.9}, kBase, 0.1);
  const auto surface = Surface::of_layers({{"fine", fine}, {"coarse", coarse}});
  ASSERT_TRUE(surface);
  expect_continuous(*surface, 10.05, 10.3, 49.7, 49.95, 1e6);
}

TEST(Layers, far_from_a_layer_nothing_is_bent) {
  const Two two;
  const HeightField field(two.surface), alone(two.base);
  std::vector<Geographic> places;
  for (int i = 0; i < 50; ++i) places.push_back({10.0 + 0.002 * i, 49.45 + 0.0001 * i});
  std::vector<double> h(places.size()), base(places.size());
  field.filled(places, h);
  alone.filled(places, base);
  EXPECT_EQ(h, base);
}

TEST(Layers, where_nothing_lies_below_a_layer_is_as_it_is_alone) {
  const auto far = made(rough_terrain(20, 20, 6), {60, 10}, kBase);
  const Two two;
  const auto surface = Surface::of_layers({{"far", far}, {"fine", two.fine}});
  ASSERT_TRUE(surface);
  const HeightField field(*surface), alone(two.fine);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(10.0, 10.6), y(49.4, 50.0);
  std::vector<Geographic> places;
  for (int i = 0; i < 500; ++i) places.push_back({x(random), y(random)});
  std::vector<double> h(places.size()), own(places.size());
  field.filled(places, h);
  alone.filled(places, own);
  for (std::size_t i = 0; i < h.size(); ++i) {
    std::vector<double> inside(1);
    alone.at({&places[i], 1}, inside);
    EXPECT_NEAR(h[i], own[i], std::isnan(inside[0]) ? 1e-9 : 300) << i;
  }
}

TEST(Layers, one_by_one_or_together_gives_the_same_heights) {
  const Two two;
  HeightField loaded(two.surface);
  ASSERT_TRUE(loaded.load(1, 0, 0, 100, 100));
  std::mt19937 random(8);
  std::uniform_real_distribution<double> x(10.15, 10.45), y(49.55, 49.85);
  std::vector<Geographic> places;
  for (int i = 0; i < 300; ++i) places.push_back({x(random), y(random)});
  std::vector<double> together(places.size());
  loaded.filled(places, together);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const HeightField fresh(two.surface);
    double alone = 0;
    fresh.filled({&places[i], 1}, {&alone, 1});
    EXPECT_EQ(alone, together[i]) << i;
  }
}

TEST(Layers, layers_that_touch_across_the_antimeridian_meet_without_a_step) {
  const auto west = made(rough_terrain(40, 40, 9), {179.61, 10.2}, kBase);  // ends at 180
  const auto east = made(rough_terrain(40, 40, 10), {-180, 10.2}, kBase);
  const auto surface = Surface::of_layers({{"west", west}, {"east", east}});
  ASSERT_TRUE(surface);
  const HeightField field(*surface);
  for (int i = 0; i < 20; ++i) {
    const double lat = 10.1 - 0.007 * i;
    const std::vector<Geographic> places = {{-179.999999, lat}, {-180, lat}};
    std::vector<double> h(2);
    field.at(places, h);
    EXPECT_NEAR(h[0], h[1], 0.1) << lat;
  }
}

TEST(Layers, tiny_layers_and_layers_of_voids_do_no_harm) {
  const auto base = made(rough_terrain(60, 60, 1), {10, 50}, kBase);
  const std::vector<std::pair<int, int>> sizes = {{1, 1}, {2, 2}, {1, 5}, {8, 8}};
  for (const auto& [cols, rows] : sizes) {
    const bool voids = cols == 8;
    const auto tiny =
        made(HeightGrid(cols, rows, voids ? HeightGrid::kVoid : 700.f), {10.25, 49.75}, kFine);
    const auto surface = Surface::of_layers({{"base", base}, {"tiny", tiny}});
    ASSERT_TRUE(surface);
    const HeightField field(*surface), alone(base);
    const std::vector<Geographic> places = {{10.25, 49.75}, {10.2501, 49.7501}, {10.0, 49.5}};
    std::vector<double> h(3), below(3);
    field.filled(places, h);
    alone.filled(places, below);
    if (voids) {
      EXPECT_EQ(h, below);
    } else {
      EXPECT_EQ(h[0], 700);
      EXPECT_NE(h[1], below[1]);
      EXPECT_EQ(h[2], below[2]);
    }
  }
}

TEST(Layers, raised_posts_are_h_and_hidden_ones_are_gone) {
  const Two two;
  const HeightField field(two.surface);
  const auto places = posts_of(*two.base);
  std::vector<double> raised(two.base->grid().values().begin(), two.base->grid().values().end());
  field.raise(0, places, raised);
  std::vector<double> h(places.size());
  std::vector<int> deciding(places.size());
  field.at(places, h, deciding);
  std::size_t bent = 0, hidden = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(std::isnan(raised[i]), deciding[i] == 1);
    if (deciding[i] == 1) {
      ++hidden;
      continue;
    }
    EXPECT_EQ(raised[i], h[i]);
    bent += raised[i] != double(two.base->grid().values()[i]);
  }
  EXPECT_GT(hidden, 100u);
  EXPECT_GT(bent, 20u);
}

TEST(Layers, posts_of_a_part_have_h_whether_or_not_a_layer_above_is_near) {
  for (const double turn : {0.0, 0.3}) {
    const auto base = made(rough_terrain(60, 60, 1), {10, 50}, kBase, turn);
    const Two two;
    const auto surface = Surface::of_layers({{"base", base}, {"fine", two.fine}});
    ASSERT_TRUE(surface);
    const HeightField field(*surface);
    const TileId tile = *tiling::tile(6, 67, 49);  // 8.4..11.3 E, 47.8..50.6 N
    const GeoRect rect = tiling::rect(tile);
    std::size_t plain = 0, bent = 0, hidden = 0;
    for (int row = 0; row < 60; row += 6)
      for (int col = 0; col < 60; col += 6) {
        const LayerWindow part{.layer = 0, .posts = {col, row, 6, 6}, .alone = false};
        const auto posts = TilePosts::read(field, {&part, 1}, tile);
        ASSERT_TRUE(posts);
        posts->visit([&](const auto& samples) {
          for (std::size_t i = 0; i < samples.size(); ++i) {
            const Vec3 s = samples.sample(i);
            const Geographic p{rect.west + s.x / 32767 * rect.width(),
                               rect.south + s.y / 32767 * rect.height()};
            double h = 0, alone = 0;
            int deciding = 1;
            field.at({&p, 1}, {&h, 1}, {&deciding, 1});
            HeightField(base).at({&p, 1}, {&alone, 1});
            EXPECT_EQ(deciding, 0);
            EXPECT_NEAR(s.z, h, 0.01);
            ++(std::abs(alone - h) < 0.01 ? plain : bent);
          }
        });
        hidden += 36 - posts->inside();
      }
    EXPECT_GT(plain, 1000u);
    EXPECT_GT(bent, 20u);
    EXPECT_GT(hidden, 100u);
  }
}

TEST(Layers, the_layer_that_answers_is_named) {
  const Two two;
  const auto fine = height_at(two.surface, {10.26, 49.74});
  const auto base = height_at(two.surface, {10.02, 49.5});
  const auto none = height_at(two.surface, {30, 49.5});
  ASSERT_TRUE(fine && base && none);
  EXPECT_EQ(fine->layer, 1u);
  EXPECT_EQ(base->layer, 0u);
  EXPECT_EQ(base->height.coverage, Coverage::value);
  EXPECT_EQ(none->height.coverage, Coverage::outside);
}

}  // namespace
}  // namespace tind
