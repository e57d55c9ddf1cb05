// Heights for engines: posts on posts are the DEM's, coarse ones are means, what is outside comes
// from the nearest, values say heights within half a step, and any number of threads the same.

#include "terrain/heightmaps/heightmap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "proto/image/png.h"
#include "terrain/base/bytes.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/surface/height_field.h"
#include "tests/support/made_up_source.h"
#include "tests/support/projected_dem.h"
#include "tests/support/support.h"
#include "tests/support/text_dem.h"

namespace tind {
namespace {

using test::MadeUpSource;

std::shared_ptr<const DemSource> rainier() {
  const auto opened = DemSource::open(std::vector<std::string>{test::testdata("rainier.tif")});
  if (!opened) throw std::runtime_error(opened.error().what);
  return *opened;
}

RasterLattice in_degrees(Geographic north_west, double step, int cols, int rows, Vec2 spacing_m) {
  return {
      cols, rows, spacing_m, [=](double row, double first, std::span<Geographic> places) {
        for (std::size_t i = 0; i < places.size(); ++i)
          places[i] = {north_west.lon + (first + double(i)) * step, north_west.lat - row * step};
      }};
}

Vec2 spacing(const DemSource& source, double times = 1) {
  return {times * source.info().spacing_x_m, times * source.info().spacing_y_m};
}

TEST(RasterLattice, PostsOnPostsAreTheDems) {
  const MadeUpSource source(test::rough_terrain(60, 50, 3), {7, 46}, .001);
  const auto made = lattice_heights(source, in_degrees({7, 46}, .001, 60, 50, spacing(source)), {});
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_EQ(made->samples, 1);
  EXPECT_EQ(made->without_height, 0u);
  EXPECT_EQ(made->max_deviation_m, 0);
  for (int r = 1; r + 1 < 50; ++r)
    for (int c = 1; c + 1 < 60; ++c)
      EXPECT_NEAR(made->heights[std::size_t(r) * 60 + std::size_t(c)], source.grid().at(c, r),
                  1e-3);
}

TEST(RasterLattice, CoarsePostsAreMeansOfTheirCells) {
  HeightGrid grid(64, 64);
  for (int r = 0; r < 64; ++r)
    for (int c = 0; c < 64; ++c) grid.at(c, r) = float((c + r) % 2 * 100);  // a chessboard
  const MadeUpSource source(std::move(grid), {7, 46}, .001);
  // Cells of 4 x 4 posts, whose middles lie between posts.
  const auto made =
      lattice_heights(source, in_degrees({7.0055, 45.9945}, .004, 12, 12, spacing(source, 4)), {});
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_EQ(made->samples, 16);
  for (const float h : made->heights) EXPECT_NEAR(h, 50, .01);
  EXPECT_NEAR(made->max_deviation_m, 50, .01);
}

TEST(RasterLattice, VoidsAreCountedAndFilledOnlyWhereAsked) {
  const MadeUpSource source(test::terrain_with_voids(60, 50, 5), {7, 46}, .001);
  const auto lattice = in_degrees({6.95, 46.02}, .001, 160, 90, spacing(source));
  const auto open = lattice_heights(source, lattice, {});
  const auto full = lattice_heights(source, lattice, {.fill = true});
  ASSERT_TRUE(open && full);
  std::size_t holes = 0;
  HeightField field{Surface(source)};
  for (std::size_t i = 0; i < open->heights.size(); ++i) {
    EXPECT_FALSE(std::isnan(full->heights[i]));
    if (!std::isnan(open->heights[i])) {
      EXPECT_EQ(open->heights[i], full->heights[i]);
      continue;
    }
    ++holes;
    Geographic at;
    lattice.places(double(i / 160), double(i % 160), {&at, 1});
    double filled = 0;
    field.filled({&at, 1}, {&filled, 1});
    EXPECT_EQ(full->heights[i], float(filled));
  }
  EXPECT_EQ(open->without_height, holes);
  EXPECT_EQ(full->without_height, holes);
  EXPECT_GT(holes, 160u * 90u - 60u * 50u);
}

TEST(RasterLattice, AReadErrorIsNoVoid) {
  const MadeUpSource source(test::rough_terrain(60, 50, 3), {7, 46}, .001);
  source.reads_left = 0;
  const auto made = lattice_heights(source, in_degrees({7, 46}, .001, 60, 50, spacing(source)), {});
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, Errc::io);
}

TEST(PlaceMap, SizesThatEnginesTake) {
  for (const int size : {127, 253, 505, 1009, 2017, 4033, 8129, 8, 15, 16, 31, 64, 511})
    EXPECT_TRUE(engine_takes(Engine::unreal, size)) << size;
  for (const int size : {0, 1, 2, 1024, 1025, 2048, 4097, 8193, 16385})
    EXPECT_FALSE(engine_takes(Engine::unreal, size)) << size;
  for (const int size : {33, 513, 4097}) EXPECT_TRUE(engine_takes(Engine::unity, size)) << size;
  for (const int size : {17, 1009, 1024, 8193}) EXPECT_FALSE(engine_takes(Engine::unity, size));
  const auto refused = place_map(rainier(), {.cols = 2000, .rows = 2000});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::invalid_argument);
}

TEST(PlaceMap, IsSquareMetresAndCoversOrLiesInside) {
  const auto source = rainier();
  const GeoRect& b = source->info().bounds;
  for (const MapFit fit : {MapFit::cover, MapFit::inside}) {
    const auto map = place_map(source, {.fit = fit});
    ASSERT_TRUE(map) << map.error().what;
    EXPECT_EQ(map->cols, map->rows);
    EXPECT_LT(map->scale_error, 1e-4);
    const Geographic nw = map->place(0, 0), se = map->place(map->cols - 1, map->rows - 1);
    if (fit == MapFit::inside) {
      EXPECT_TRUE(b.contains(nw));
      EXPECT_TRUE(b.contains(se));
    } else {
      for (const Geographic corner : {Geographic{b.west, b.north}, Geographic{b.east, b.south}}) {
        Vec2 p;
        map->crs->from_geographic({&corner, 1}, {&p, 1});
        const Vec2 least = map->post(0, map->rows - 1), most = map->post(map->cols - 1, 0);
        EXPECT_GE(p.x, least.x - .01);
        EXPECT_GE(p.y, least.y - .01);
        EXPECT_LE(p.x, most.x + .01);
        EXPECT_LE(p.y, most.y + .01);
      }
    }
    // Neighbours are as far apart on the ground as it says, east and south alike.
    const Vec3 at = wgs84::to_ecef(nw, 0);
    for (const Geographic next : {map->place(1, 0), map->place(0, 1)})
      EXPECT_NEAR(length(wgs84::to_ecef(next, 0) - at) / map->spacing_m, 1, 1e-4);
  }
}

TEST(PlaceMap, AnotherCrsIsRefusedOrItsScaleIsSaid) {
  const auto source = rainier();
  for (const char* crs : {"EPSG:4326", "EPSG:2926", "EPSG:5773", "EPSG:99999"}) {  // degrees, feet
    const auto refused = place_map(source, {.crs = crs});
    ASSERT_FALSE(refused) << crs;
    EXPECT_EQ(refused.error().code, Errc::invalid_argument);
  }
  const auto utm = place_map(source, {.crs = "EPSG:32610"});
  ASSERT_TRUE(utm) << utm.error().what;
  EXPECT_LT(utm->scale_error, 1e-3);
  const auto web = place_map(source, {.crs = "EPSG:3857"});
  ASSERT_TRUE(web);
  EXPECT_NEAR(web->scale_error, 1 - std::cos(46.8 * std::numbers::pi / 180), .01);
}

TEST(PlaceMap, OfLayersAcrossTheAntimeridianIsWhereTheyAre) {
  const test::TempDir folder;
  const auto place = [&](double west, const std::string& name) {
    const HeightGrid grid = test::rough_terrain(100, 100, 3);
    const auto surface = Surface::of_layers(
        {{"low", test::text_dem(folder, name + "low", grid, {west, 10}, .004)},
         {"high", test::text_dem(folder, name + "high", grid, {west + .1, 10.1}, .001)}});
    if (!surface) throw std::runtime_error(surface.error().what);
    return *place_map(*surface, {});
  };
  const MapPlace across = place(179.8, "across"), elsewhere = place(100, "elsewhere");
  EXPECT_EQ(across.cols, elsewhere.cols);
  EXPECT_NEAR(across.spacing_m, elsewhere.spacing_m, 1e-3);
  const Geographic middle = across.place((across.cols - 1) / 2., (across.rows - 1) / 2.);
  EXPECT_NEAR(std::abs(middle.lon), 180, .1);
}

TEST(PlaceMap, AroundAPoleSaysWhichCrsFits) {
  const test::TempDir dir;
  const auto pole =
      test::open_projected({"pole", "EPSG:3031", -9000e3, 9000e3, 360e3, 51, 51}, dir);
  ASSERT_TRUE(pole);
  const auto refused = place_map(pole, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::invalid_argument);
  EXPECT_NE(refused.error().what.find("EPSG:3031"), std::string::npos) << refused.error().what;
  EXPECT_TRUE(place_map(pole, {.crs = "EPSG:3031"}));
}

TEST(Heightmap, ValuesAreWithinHalfAStepOfH) {
  const auto source = rainier();
  const auto place = place_map(source, {.cols = 1009, .rows = 1009, .fit = MapFit::inside});
  ASSERT_TRUE(place);
  const auto map = make_heightmap(source, *place);
  ASSERT_TRUE(map) << map.error().what;
  EXPECT_EQ(map->samples, 1);
  EXPECT_LE(map->max_error_m, map->step_m / 2 + 1e-3);
  EXPECT_EQ(*std::ranges::min_element(map->values), 0);
  EXPECT_EQ(*std::ranges::max_element(map->values), 65535);
  HeightField field{Surface(source)};
  std::mt19937 random(1);
  int compared = 0;
  for (int i = 0; i < 10'000; ++i) {
    const int c = int(random() % 1009), r = int(random() % 1009);
    const Geographic at = place->place(c, r);
    double h = 0;
    field.at({&at, 1}, {&h, 1});
    if (std::isnan(h)) continue;
    ++compared;
    const double got = map->height_m(map->values[std::size_t(r) * 1009 + std::size_t(c)]);
    ASSERT_NEAR(got, h, map->step_m / 2 + 1e-3) << c << ' ' << r;
  }
  EXPECT_GT(compared, 9'000);
}

TEST(Heightmap, NoValueIsFartherFromItsPostThanItSays) {
  std::mt19937 random(7);
  for (const float relief : {0.f, .03f, 5.f, 900.f}) {
    // High above sea level floats are coarser than the steps of a map with little relief.
    HeightGrid grid = test::rough_terrain(60, 60, random(), relief);
    for (float& h : grid.values()) h += 8191.3f;
    const MadeUpSource source(std::move(grid), {7, 0}, .001);
    const auto place = place_map(source, {.cols = 127, .rows = 127, .fit = MapFit::inside});
    ASSERT_TRUE(place) << place.error().what;
    const auto map = make_heightmap(source, *place);
    ASSERT_TRUE(map) << map.error().what;
    ASSERT_EQ(map->samples, 1);
    HeightField field{Surface(source)};
    double most = 0;
    for (int r = 0; r < 127; ++r)
      for (int c = 0; c < 127; ++c) {
        const Geographic at = place->place(c, r);
        double h = 0;
        field.at({&at, 1}, {&h, 1});
        if (std::isnan(h)) continue;
        const double got = map->height_m(map->values[std::size_t(r) * 127 + std::size_t(c)]);
        most = std::max(most, std::abs(got - h));
      }
    EXPECT_LE(most, map->max_error_m) << relief;
    EXPECT_LE(map->max_error_m, map->step_m / 2 + 5e-4 + source.info().rounding_m) << relief;
  }
}

TEST(Heightmap, IsTheSameForAnyNumberOfThreads) {
  const auto source = rainier();
  const auto place = place_map(source, {.cols = 127, .rows = 127});
  ASSERT_TRUE(place);
  const auto one = make_heightmap(source, *place, {}, 1),
             many = make_heightmap(source, *place, {}, 7);
  ASSERT_TRUE(one && many);
  EXPECT_GT(one->samples, 1);
  EXPECT_EQ(png_of(*one), png_of(*many));
  EXPECT_EQ(one->max_deviation_m, many->max_deviation_m);
}

TEST(Heightmap, WhatIsFlatHasAScale) {
  const MadeUpSource source(HeightGrid(40, 40, 812.25f), {7, 46}, .001);
  const auto place = place_map(source, {.engine = Engine::unity});
  ASSERT_TRUE(place) << place.error().what;
  const auto map = make_heightmap(source, *place);
  ASSERT_TRUE(map) << map.error().what;
  EXPECT_GT(map->step_m, 0);
  for (const std::uint16_t v : map->values) EXPECT_EQ(map->height_m(v), 812.25);
}

TEST(Heightmap, VoidsHaveTheNearestPostsHeight) {
  HeightGrid grid(40, 40, 100);
  for (int r = 0; r < 40; ++r)
    for (int c = 20; c < 40; ++c) grid.at(c, r) = c < 30 ? HeightGrid::kVoid : 300;
  const MadeUpSource source(std::move(grid), {7, 0}, .001);
  const auto place = place_map(source, {.engine = Engine::unity});
  ASSERT_TRUE(place);
  const auto map = make_heightmap(source, *place);
  ASSERT_TRUE(map);
  EXPECT_NEAR(map->without_height, 10. / 39, .05);
  for (const std::uint16_t v : map->values) EXPECT_TRUE(v == 0 || v == 65535) << v;
  const auto lies_in_void = make_heightmap(
      source,
      *place_map(source, {.engine = Engine::unity, .area = GeoRect{7.0215, -.03, 7.027, -.02}}));
  ASSERT_FALSE(lies_in_void);
  EXPECT_EQ(lies_in_void.error().code, Errc::bad_data);
}

TEST(Heightmap, KeepsToARangeOrSaysThatItCannot) {
  const auto source = rainier();
  const auto place = place_map(source, {.cols = 127, .rows = 127});
  const auto map = make_heightmap(source, *place, HeightRange{0, 6553.5});
  ASSERT_TRUE(map) << map.error().what;
  EXPECT_DOUBLE_EQ(map->step_m, .1);
  EXPECT_EQ(map->zero_m, 0);
  EXPECT_LE(map->max_error_m, .0505);
  const auto refused = make_heightmap(source, *place, HeightRange{0, 3000});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::out_of_range);
}

TEST(Heightmap, BytesAndRowsAsAskedFor) {
  Heightmap map;
  map.place.cols = 2, map.place.rows = 2;
  map.values = {0x0102, 0x0304, 0x0506, 0x0708};
  const auto bytes = [&](ByteOrder order, FirstRow row) {
    std::string digits;
    for (const char c : raw_of(map, order, row)) digits += char('0' + c);
    return digits;
  };
  EXPECT_EQ(bytes(ByteOrder::little, FirstRow::north), "21436587");
  EXPECT_EQ(bytes(ByteOrder::big, FirstRow::north), "12345678");
  EXPECT_EQ(bytes(ByteOrder::little, FirstRow::south), "65872143");
}

}  // namespace
}  // namespace tind
