// Tiles of layers: the same promises as of one DEM.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "proto/tile/quantized_mesh.h"
#include "terrain/check/explain.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/build/estimate.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/store/open/open_store.h"
#include "terrain/surface/open_surface.h"
#include "terrain/surface/post_warp.h"
#include "terrain/surface/surface.h"
#include "tests/support/layered_world.h"
#include "tests/support/shapes_file.h"

namespace tind {
namespace {

using test::expect_no_violation;
using test::expect_rims_held;
using test::made;
using test::MadeUpSource;
using test::rough_terrain;
using test::three_ranks;
using test::tiles_in;

BuildOptions options(const std::string& output, int threads) {
  BuildOptions o;
  o.tiles.effort = Effort::fast;
  o.output = output;
  o.threads = threads;
  return o;
}

/// Water in which no post lies is in no range of posts, but its shores are vertices.
TEST(LayeredTiles, plan_has_room_for_the_level_of_every_water) {
  test::ShapesFile high("high");
  high.polygon({test::square(10.2031, 49.8031, 0.0005)}, 7000);
  ShapeFiles files;
  files.flatten = {high.write()};
  const auto shaped = shaped_surface(three_ranks(), files);
  ASSERT_TRUE(shaped) << shaped.error().what;
  for (const Surface& surface : {three_ranks(), *shaped}) {
    const auto range = scan_heights(surface);
    ASSERT_TRUE(range);
    const auto plan = TilePlan::make(surface, *range, {});
    ASSERT_TRUE(plan) << plan.error().what;
    for (int z = 0; z <= plan->max_level(); ++z)
      EXPECT_EQ(plan->level(z).highest_m > 7000, surface.shapes() != nullptr) << z;
  }
}

/// One thread and four, in a batch and on demand.
void expect_the_same_however_made(const std::string& folder, const Surface& surface,
                                  BuildOptions o) {
  const auto tiles = tiles_in(folder);
  const test::TempDir dir;
  o.output = dir.file("four");
  o.threads = 4;
  ASSERT_TRUE(build_tiles(surface, o));
  EXPECT_EQ(tiles, tiles_in(o.output));
  const auto on_demand = open_dem_tiles(surface, o.tiles);
  ASSERT_TRUE(on_demand);
  std::size_t n = 0;
  for (const auto& [name, bytes] : tiles) {
    int z = 0;
    unsigned x = 0, y = 0;
    ASSERT_EQ(std::sscanf(name.c_str(), "%d/%u/%u", &z, &x, &y), 3);
    if (n++ % 11 != 0 && z > 9) continue;
    const auto tile = (*on_demand)->tile({z, x, y}, {});
    ASSERT_TRUE(tile);
    EXPECT_EQ(std::string(tile->bytes.begin(), tile->bytes.end()), bytes) << name;
  }
}

TEST(LayeredTiles, have_no_cracks_are_within_what_they_state_and_are_the_same_however_made) {
  const test::TempDir dir;
  const Surface surface = three_ranks();
  const auto built = build_tiles(surface, options(dir.file("tiles"), 1));
  ASSERT_TRUE(built);
  EXPECT_EQ(built->over_budget, 0u);
  expect_no_violation(dir.file("tiles"), surface);
  expect_the_same_however_made(dir.file("tiles"), surface, options("", 1));
}

TEST(LayeredTiles, that_rest_on_the_residual_index_keep_the_same_promises) {
  test::ShapesFile lake("lake");
  lake.polygon({test::square(10.62, 49.42, 0.01)}, 700);
  ShapeFiles files;
  files.flatten = {lake.write()};
  const auto shaped = shaped_surface(three_ranks(), files);
  ASSERT_TRUE(shaped) << shaped.error().what;
  for (const Surface& surface : {three_ranks(), *shaped}) {
    const test::TempDir dir;
    BuildOptions o = options(dir.file("tiles"), 1);
    o.tiles.exact_posts = 1 << 12;
    const auto built = build_tiles(surface, o);
    ASSERT_TRUE(built) << built.error().what;
    EXPECT_GE(built->indexed_level, 10);
    EXPECT_TRUE(built->index_made);
    EXPECT_EQ(built->over_budget, 0u);
    expect_no_violation(dir.file("tiles"), surface);
    EXPECT_GT(expect_rims_held(dir.file("tiles"), surface), 1000u);
    std::size_t bounds = 0;
    for (const auto& [name, bytes] : tiles_in(dir.file("tiles"))) {
      const auto mesh =
          proto::decode({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
      ASSERT_TRUE(mesh) << name;
      const auto metadata = nlohmann::json::parse(mesh->metadata);
      if (!metadata.contains("residual_m")) continue;
      ++bounds;
      EXPECT_EQ(metadata["error_kind"], "bound") << name;
      EXPECT_GE(metadata["max_error_m"], metadata["residual_m"]) << name;
    }
    EXPECT_GT(bounds, 10u);
    if (!surface.shapes()) expect_the_same_however_made(dir.file("tiles"), surface, o);
  }
}

/// A base with a hole, and in the hole a finer layer with a gap around it. One of its columns lies
/// some units beside an edge of a tile of the level at which the base ends: posts that the border
/// has to hold, since hardly a vertex fits between.
Surface inset_in_a_hole(unsigned seed) {
  constexpr int kBase = 80, kHole = 24, kGap = 3, kFiner = 10, kEndOfBase = 10;
  constexpr double kStep = 1.0 / 300;
  const auto noise = [seed](int i, int j, double amplitude) {
    std::uint64_t h = seed * 0x9e3779b97f4a7c15u + std::uint64_t(i) * 0xbf58476d1ce4e5b9u +
                      std::uint64_t(j) * 0x94d049bb133111ebu;
    h = (h ^ h >> 31) * 0xd6e8feb86659fd93u;
    return amplitude * (double((h ^ h >> 29) >> 40) / double(1 << 24) - 0.5);
  };
  const auto hills = [seed](double x, double y) {  // in steps of the base
    return 800 + 300 * std::sin(0.21 * x + seed) * std::cos(0.17 * y - seed) +
           60 * std::sin(0.9 * x - 0.7 * y);
  };
  HeightGrid base(kBase, kBase);
  for (int r = 0; r < kBase; ++r)
    for (int c = 0; c < kBase; ++c)
      base.at(c, r) = std::max(std::abs(c - kBase / 2), std::abs(r - kBase / 2)) < kHole
                          ? HeightGrid::kVoid
                          : float(hills(c, r) + noise(c, r, 60));
  const int side = 2 * (kHole - kGap) * kFiner;
  const Geographic corner{10, 46.5};
  const double tile = tiling::tile_degrees(kEndOfBase),
               edge = std::ceil((corner.lon + (kBase / 2 - 4) * kStep) / tile) * tile,
               beside = (1.01 + 0.015 * seed) * tile / kTileExtent;
  const double wanted = kBase / 2 - kHole + kGap, column = (edge + beside - corner.lon) / kStep;
  const double first = column - std::floor((column - wanted) * kFiner) / kFiner;
  HeightGrid inset(side, side);
  for (int r = 0; r < side; ++r)
    for (int c = 0; c < side; ++c)
      inset.at(c, r) = float(hills(first + double(c) / kFiner, first + double(r) / kFiner) +
                             noise(c, r + 9999, 30 + seed % 4 * 30));
  return *Surface::of_layers(
      {{"base", made(std::move(base), corner, kStep)},
       {"inset", made(std::move(inset), {corner.lon + first * kStep, corner.lat - first * kStep},
                      kStep / kFiner)}});
}

TEST(LayeredTiles, where_a_coarse_layer_ends_beside_a_fine_one_its_bound_holds) {
  // At these places, 1.5 to 1.7 units beside the edge, tiles whose borders have the samples of
  // their level are over their budget.
  for (const unsigned seed : {34u, 35u, 36u, 39u, 41u, 43u}) {
    const test::TempDir dir;
    const Surface surface = inset_in_a_hole(seed);
    const auto plan = TilePlan::make(surface, HeightRange{}, {});
    ASSERT_TRUE(plan);
    ASSERT_EQ(plan->deepest_of(0), 10);
    ASSERT_LT(plan->deepest_of(0), plan->deepest_of(1));
    BuildOptions o = options(dir.file("tiles"), 2);
    o.tiles.first_level = plan->deepest_of(0) - 1;
    o.tiles.last_level = plan->deepest_of(0);
    const auto built = build_tiles(surface, o);
    ASSERT_TRUE(built) << built.error().what;
    EXPECT_EQ(built->over_budget, 0u) << seed << ": " << built->worst_over_budget << " states "
                                      << built->worst_over_budget_m << " m";
    expect_no_violation(dir.file("tiles"), surface);
  }
}

TEST(LayeredTiles, an_update_makes_again_what_a_layer_touches_and_no_more) {
  const test::TempDir dir;
  ASSERT_TRUE(build_tiles(three_ranks(), options(dir.file("tiles"), 2)));
  const auto update = build_tiles(three_ranks(50), options(dir.file("tiles"), 2));
  ASSERT_TRUE(update) << update.error().what;
  EXPECT_TRUE(update->update.updated);
  EXPECT_EQ(update->update.changed_blocks, 1u);
  EXPECT_GT(update->reused, 0u);  // of a small area: what layers bend reaches far
  ASSERT_TRUE(build_tiles(three_ranks(50), options(dir.file("fresh"), 2)));
  EXPECT_EQ(tiles_in(dir.file("tiles")), tiles_in(dir.file("fresh")));
}

TEST(LayeredTiles, deeper_levels_exist_only_where_finer_layers_are) {
  const Surface surface = three_ranks();
  const auto plan = TilePlan::make(surface, HeightRange{}, {});
  ASSERT_TRUE(plan);
  EXPECT_LT(plan->deepest_of(0), plan->deepest_of(1));
  EXPECT_EQ(plan->deepest_of(1), plan->deepest_of(2));
  EXPECT_LT(plan->deepest_of(2), plan->deepest_of(3));
  EXPECT_EQ(plan->deepest_of(3), plan->max_level());
  const GeoRect& town = surface.layers()[3].source->info().bounds;
  for (const TileRange& r : plan->tiles(plan->max_level()).ranges()) {
    const double side = tiling::tile_degrees(plan->max_level());
    EXPECT_GT(town.west, r.west * side - 180 - side);
    EXPECT_LT(town.east, (r.east + 1) * side - 180 + side);
  }
}

TEST(LayeredTiles, where_a_layer_ends_its_tiles_keep_its_bound) {
  const Surface surface = three_ranks();
  const auto plan = TilePlan::make(surface, HeightRange{}, {});
  ASSERT_TRUE(plan);
  const int z = plan->deepest_of(0);
  bool ends = false;
  for (std::uint64_t i = 0; i < plan->tiles(z).size(); ++i) {
    const auto [x, y] = plan->tiles(z)[i];
    const TileId id{z, x, y};
    int below = 0;
    for (int part = 0; part < 4; ++part) below += plan->available(id.child(part % 2, part / 2));
    if (below > 0) continue;
    ends = true;
    EXPECT_DOUBLE_EQ(
        plan->level(id).budget_m,
        std::min(tiling::level_error(z), rank_spacing_m(surface.layers()[0].source->info()) / 32));
    EXPECT_LE(plan->level(id, TileSide::west).fit_error_m, plan->level(id).fit_error_m);
  }
  EXPECT_TRUE(ends);
}

/// Rough posts 14 km apart, and 300 m above them fine ones.
Surface over_sparse_posts() {
  HeightGrid fine = test::terrain_with_voids(90, 90, 2);
  for (float& z : fine.values()) z += 300;
  return *Surface::of_layers({{"base", made(rough_terrain(12, 12, 1, 2000), {9.5, 50.5}, 0.125)},
                              {"fine", made(std::move(fine), {10.3, 49.7}, 0.004, 0.1)}});
}

TEST(LayeredTiles, follow_what_a_layer_bends_where_there_is_no_post) {
  const test::TempDir dir;
  const Surface surface = over_sparse_posts();
  const auto built = build_tiles(surface, options(dir.file("tiles"), 2));
  ASSERT_TRUE(built);
  EXPECT_EQ(built->over_budget, 0u);
  expect_no_violation(dir.file("tiles"), surface);
  EXPECT_GT(expect_rims_held(dir.file("tiles"), surface), 1000u);
}

/// Beside a layer that is lower than a ridge of what lies below, the plain beyond the ridge is bent
/// down, below every post of either: those heights belong into tiles, too.
TEST(LayeredTiles, hold_heights_that_no_post_has) {
  HeightGrid ridges(40, 40, 0.f);
  for (int r = 0; r < 40; ++r)
    for (int c = 0; c < 40; c += 2) ridges.at(c, r) = 400;
  const Surface surface =
      *Surface::of_layers({{"base", made(std::move(ridges), {10, 50}, 0.004)},
                           {"town", made(HeightGrid(60, 60, 20.f), {10.0402, 49.96}, 0.001)}});
  const test::TempDir dir;
  BuildOptions o = options(dir.file("tiles"), 2);
  o.tiles.max_error_m = 2;
  ASSERT_TRUE(build_tiles(surface, o));
  const auto lowest = [&] {
    HeightField field(surface);
    std::vector<Geographic> places;
    for (int i = 0; i < 4000; ++i) places.push_back({10.03 + i % 80 * .001, 49.97 - i / 80 * .001});
    std::vector<double> heights(places.size());
    field.at(places, heights);
    return *std::ranges::min_element(heights);
  };
  EXPECT_LT(lowest(), -20);
  expect_no_violation(dir.file("tiles"), surface);
}

TEST(LayeredTiles, reach_as_far_as_a_layer_bends_and_meet_coarser_ones_at_the_finer_bound) {
  const Surface surface = over_sparse_posts();
  const auto plan = TilePlan::make(surface, HeightRange{}, {});
  ASSERT_TRUE(plan);
  const SurfaceLayer& fine = surface.layers()[1];
  const GeoRect& own = fine.source->info().bounds;
  const double up = fine.blend_m / 111320;
  const int z = plan->deepest_of(1);
  const double side = tiling::tile_degrees(z);
  for (const double lat : {own.south - 0.95 * up, own.north + 0.95 * up}) {
    const auto id = tiling::tile(std::uint32_t(z), std::uint32_t((own.west + 180) / side),
                                 std::uint32_t((lat + 90) / side));
    EXPECT_TRUE(plan->available(*id)) << lat;
  }
  // Edges with tiles below on one side only.
  const auto goes_on = [&](TileId t, int east) {
    return plan->available(t.child(east, 0)) || plan->available(t.child(east, 1));
  };
  std::size_t edges = 0;
  for (int level = 0; level < z; ++level)
    for (std::uint64_t i = 0; i < plan->tiles(level).size(); ++i) {
      const auto [x, y] = plan->tiles(level)[i];
      const TileId here{level, x, y}, there{level, (x + 1) % tiling::columns(level), y};
      if (goes_on(here, 1) == goes_on(there, 0)) continue;
      ++edges;
      const LevelPlan& mine = plan->level(here, TileSide::east);
      EXPECT_LE(mine.fit_error_m, rank_spacing_m(fine.source->info()) / 32);
      if (plan->available(there)) {
        EXPECT_EQ(mine.border_tolerance_m, plan->level(there, TileSide::west).border_tolerance_m);
      }
    }
  EXPECT_GT(edges, 3u);
}

TEST(LayeredTiles, are_as_many_as_an_estimate_says_and_as_fine_as_explain_says) {
  const test::TempDir dir;
  const Surface surface = over_sparse_posts();
  const BuildOptions o = options(dir.file("tiles"), 2);
  const auto estimate = estimate_build(surface, o);
  const auto built = build_tiles(surface, o);
  ASSERT_TRUE(estimate && built);
  EXPECT_EQ(estimate->tiles, built->tiles);
  ASSERT_EQ(estimate->levels.size(), built->levels.size());
  for (std::size_t z = 0; z < built->levels.size(); ++z)
    EXPECT_EQ(estimate->levels[z].tiles, built->levels[z].tiles) << z;

  const auto store = open_store(dir.file("tiles"));
  const auto plan = TilePlan::make(surface, HeightRange{}, {});
  ASSERT_TRUE(store && plan);
  std::size_t by_layers = 0;  // tiles that are as fine as they are because a layer ends there
  for (int z = 0; z < plan->max_level(); ++z)
    for (std::uint64_t i = 0; i < plan->tiles(z).size(); ++i) {
      const auto [x, y] = plan->tiles(z)[i];
      const TileId id{z, x, y};
      const auto story = explain_tile(*store, id, {.files = {}, .dem = {}, .surface = surface});
      ASSERT_TRUE(story) << story.error().what;
      EXPECT_EQ(story->budget_m, plan->level(id).budget_m) << id.text();
      ASSERT_TRUE(story->posts);
      EXPECT_LE(story->posts->max_error_m, *story->stated.max_error_m + 1e-6) << id.text();
      EXPECT_FALSE(story->limited_by == "level" && story->budget_m < 0.999 * tiling::level_error(z))
          << id.text();
      by_layers += story->limited_by == "max-error";
    }
  EXPECT_GT(by_layers, 0u);
}

TEST(LayeredTiles, one_sided_tiles_of_layers_stay_on_their_side) {
  const test::TempDir dir;
  const auto surface =
      Surface::of_layers({{"base", made(rough_terrain(40, 40, 1, 500), {10, 50}, 0.02)},
                          {"fine", made(rough_terrain(60, 60, 2, 300), {10.3, 49.7}, 0.005, 0.2)}});
  ASSERT_TRUE(surface);
  BuildOptions o = options(dir.file("tiles"), 2);
  o.tiles.side = Side::above;
  ASSERT_TRUE(build_tiles(*surface, o));
  expect_no_violation(dir.file("tiles"), *surface);
}

TEST(LayeredTiles, layers_of_different_datums_are_refused_by_name) {
  class Above : public MadeUpSource {
   public:
    Above(Geographic corner, VerticalDatum datum)
        : MadeUpSource(rough_terrain(9, 9, 1), corner, 0.01), info_(MadeUpSource::info()) {
      info_.datum = datum;
    }
    const DemInfo& info() const override { return info_; }

   private:
    DemInfo info_;
  };
  const auto a = std::make_shared<const Above>(Geographic{10, 50}, VerticalDatum::ellipsoid);
  const auto b = std::make_shared<const Above>(Geographic{10, 50}, VerticalDatum::egm96);
  const auto c = std::make_shared<const Above>(Geographic{10, 50}, VerticalDatum::unknown);
  const auto mixed = Surface::of_layers({{"low", a}, {"high", b}});
  ASSERT_FALSE(mixed);
  EXPECT_EQ(mixed.error().code, Errc::invalid_argument);
  EXPECT_NE(mixed.error().what.find("low"), std::string::npos);
  EXPECT_NE(mixed.error().what.find("high"), std::string::npos);
  const auto vague = Surface::of_layers({{"low", a}, {"high", c}});
  ASSERT_TRUE(vague);
  ASSERT_EQ(vague->info().warnings.size(), 1u);
  EXPECT_EQ(vague->info().datum, VerticalDatum::unknown);
}

}  // namespace
}  // namespace tind
