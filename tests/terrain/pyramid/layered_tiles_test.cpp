// Tiles of layers: the same promises as of one DEM.

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <map>
#include <string>

#include "terrain/base/file_io.h"
#include "terrain/check/check.h"
#include "terrain/check/check_decode.h"
#include "terrain/check/check_surface.h"
#include "terrain/check/explain.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/build/estimate.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/store/open/open_store.h"
#include "terrain/surface/rim_samples.h"
#include "terrain/surface/surface.h"
#include "tests/support/made_up_source.h"

namespace tind {
namespace {

using test::MadeUpSource;
using test::rough_terrain;

std::shared_ptr<const DemSource> made(HeightGrid grid, Geographic corner, double spacing,
                                      double turn = 0) {
  return std::make_shared<const MadeUpSource>(std::move(grid), corner, spacing, turn);
}

/// A coarse base, two finer ones of one rank that overlap, one of them turned and with voids, and a
/// small fine one over the rim of those.
Surface three_ranks(double lift = 0) {
  HeightGrid top = rough_terrain(80, 80, 4, 300);
  top.at(40, 40) += float(lift);
  return *Surface::of_layers(
      {{"base", made(rough_terrain(60, 50, 1, 2000), {10, 50}, 0.02)},
       {"west", made(test::terrain_with_voids(90, 90, 2), {10.3, 49.7}, 0.004)},
       {"east", made(rough_terrain(90, 90, 3, 800), {10.55, 49.65}, 0.004, 0.1)},
       {"town", made(std::move(top), {10.6, 49.5}, 0.001, -0.3)}});
}

BuildOptions options(const std::string& output, int threads) {
  BuildOptions o;
  o.tiles.effort = Effort::fast;
  o.output = output;
  o.threads = threads;
  return o;
}

void expect_no_violation(const std::string& folder, const Surface& surface) {
  const auto checked = check_tiles(folder, {.threads = 2, .source = surface});
  ASSERT_TRUE(checked) << checked.error().what;
  for (std::size_t rule = 0; rule < kCheckRuleCount; ++rule)
    if (kCheckRules[rule].severity == Severity::violation) {
      const auto& [count, examples] = checked->findings[rule];
      EXPECT_EQ(count, 0u) << kCheckRules[rule].id << (count ? ", " + examples[0] : "");
    }
}

/// All files below, by name.
std::map<std::string, std::string> tiles_in(const std::string& folder) {
  std::map<std::string, std::string> tiles;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".terrain")
      tiles[entry.path().lexically_relative(folder).string()] =
          *read_whole_file(entry.path().string());
  return tiles;
}

TEST(LayeredTiles, have_no_cracks_are_within_what_they_state_and_are_the_same_however_made) {
  const test::TempDir dir;
  const Surface surface = three_ranks();
  const auto one = build_tiles(surface, options(dir.file("one"), 1));
  const auto four = build_tiles(three_ranks(), options(dir.file("four"), 4));
  ASSERT_TRUE(one && four);
  EXPECT_EQ(one->over_budget, 0u);
  expect_no_violation(dir.file("one"), surface);
  const auto tiles = tiles_in(dir.file("one"));
  EXPECT_EQ(tiles, tiles_in(dir.file("four")));
  const auto on_demand = open_dem_tiles(surface, options("", 1).tiles);
  ASSERT_TRUE(on_demand);
  std::size_t n = 0;
  for (const auto& [name, bytes] : tiles) {
    if (n++ % 11 != 0) continue;
    int z = 0;
    unsigned x = 0, y = 0;
    ASSERT_EQ(std::sscanf(name.c_str(), "%d/%u/%u", &z, &x, &y), 3);
    const auto tile = (*on_demand)->tile({z, x, y}, {});
    ASSERT_TRUE(tile);
    EXPECT_EQ(std::string(tile->bytes.begin(), tile->bytes.end()), bytes) << name;
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
  const auto plan = TilePlan::make(surface, HeightRange{}, {});
  ASSERT_TRUE(plan);
  const HeightField field(surface);
  std::size_t looked_at = 0;
  for (const auto& [name, bytes] : tiles_in(dir.file("tiles"))) {
    int z = 0;
    unsigned x = 0, y = 0;
    ASSERT_EQ(std::sscanf(name.c_str(), "%d/%u/%u", &z, &x, &y), 3);
    const TileId id = *tiling::tile(std::uint32_t(z), x, y);
    const auto samples = rim_samples(field, id);
    ASSERT_TRUE(samples);
    Findings none;
    CheckedTile tile;
    const std::vector<std::uint8_t> data(bytes.begin(), bytes.end());
    ASSERT_TRUE(check_decode(data, name, tile, none));
    const auto decoded = decode_tile(id, data);
    ASSERT_TRUE(decoded && decoded->certificate);
    const TileSurface mesh(tile);
    for (const Vec3& s : *samples) {
      ++looked_at;
      const auto gap = mesh.gap_at(s.x, s.y, s.z);
      ASSERT_TRUE(gap);
      EXPECT_LE(std::abs(gap->worst()), decoded->certificate->max_error_m + 1e-3) << name;
    }
  }
  EXPECT_GT(looked_at, 1000u);
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
