// Pyramids with lakes: level, without cracks, certified, the same for any number of threads.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "terrain/base/hash.h"
#include "terrain/check/check.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/plan/tile_method.h"
#include "terrain/shapes/shaped_dem.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/simplify/method_text.h"
#include "terrain/simplify/methods.h"
#include "tests/support/made_up_source.h"
#include "tests/support/shapes_file.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::MadeUpSource;
using test::ShapesFile;

/// Hills, 30 m posts, around a corner that four tiles of every level from 6 on share.
std::shared_ptr<const DemSource> hills() {
  constexpr int kSide = 241;
  HeightGrid grid(kSide, kSide);
  for (int r = 0; r < kSide; ++r)
    for (int c = 0; c < kSide; ++c)
      grid.at(c, r) = float(300 + 20 * std::sin(c * 0.07) * std::cos(r * 0.05) + 0.3 * c);
  for (int r = 100; r < 110; ++r)
    for (int c = 60; c < 75; ++c) grid.at(c, r) = HeightGrid::kVoid;
  return std::make_shared<MadeUpSource>(grid, Geographic{11.25 - 0.033, 45 + 0.035}, 1.0 / 3600);
}

std::vector<Vec2> blob(double lon, double lat, double radius, int points) {
  std::vector<Vec2> ring;
  for (int k = 0; k < points; ++k) {
    const double a = 2 * M_PI * k / points,
                 r = radius * (1 + 0.3 * std::sin(3 * a) + 0.1 * std::cos(11 * a));
    ring.push_back({lon + r * std::cos(a), lat + r * std::sin(a)});
  }
  return ring;
}

/// One over the corner, with an island; one along an edge of tiles; one in a void; a small one.
void lakes(ShapesFile& file) {
  file.polygon({blob(11.25, 45, 0.012, 300), blob(11.252, 45.003, 0.003, 40)});
  file.polygon({test::square(11.25, 45.015, 0.01)});
  file.polygon({blob(11.2355, 45.0058, 0.003, 60)});
  file.polygon({blob(11.262, 44.985, 0.0006, 12)});
}

std::map<std::string, std::string> files_in(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".terrain") continue;
    std::ifstream in(entry.path(), std::ios::binary);
    files[std::filesystem::relative(entry.path(), folder).string()] =
        std::string(std::istreambuf_iterator<char>(in), {});
  }
  return files;
}

void build(std::shared_ptr<const DemSource> dem, const std::string& folder, int threads) {
  BuildOptions o;
  o.output = folder;
  o.threads = threads;
  const auto report = build_tiles(dem, o);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->over_budget, 0u);
}

void expect_sound(const std::string& tiles, const Surface& source) {
  CheckOptions options;
  options.source = source;
  const auto report = check_tiles(tiles, options);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_TRUE(report->ok());
  for (const CheckLevel& level : report->levels) EXPECT_EQ(level.crack_m, 0);
}

TEST(ShapedTiles, keep_every_promise_and_have_the_same_bytes_for_any_number_of_threads) {
  ShapesFile water("water"), roads("roads");
  lakes(water);
  roads.line({{11.22, 44.98}, {11.25, 45}, {11.28, 45.03}}).line({{11.22, 45.03}, {11.28, 44.97}});
  ShapeFiles files;
  files.flatten = files.water = {water.write()};
  files.breaklines = {roads.write()};
  const auto shaped = shaped_dem(hills(), files);
  ASSERT_TRUE(shaped) << shaped.error().what;
  test::TempDir one, four;
  build(*shaped, one.file("tiles"), 1);
  build(*shaped, four.file("tiles"), 4);
  const auto tiles = files_in(one.file("tiles"));
  EXPECT_EQ(tiles, files_in(four.file("tiles")));
  EXPECT_GT(tiles.size(), 20u);
  expect_sound(one.file("tiles"), *shaped);
}

TEST(ShapedTiles, have_breaklines_of_few_points_that_follow_the_ground) {
  const auto dem = DemSource::open(std::array{test::testdata("rainier.tif")});
  ASSERT_TRUE(dem) << dem.error().what;
  ShapesFile roads("long"), water("beside");
  roads.line({{-121.95, 46.7}, {-121.55, 47}}).line({{-121.9, 46.98}, {-121.6, 46.72}});
  water.polygon({blob(-121.65, 46.78, 0.01, 30)});
  ShapeFiles files;
  files.breaklines = {roads.write()};
  files.flatten = {water.write()};
  const auto shaped = shaped_dem(*dem, files);
  ASSERT_TRUE(shaped) << shaped.error().what;
  test::TempDir dir;
  BuildOptions o;
  o.output = dir.file("tiles");
  o.tiles.max_error_m = 60;
  const auto built = build_tiles(*shaped, o);
  ASSERT_TRUE(built) << built.error().what;
  EXPECT_EQ(built->without_lines, 0u);
  EXPECT_EQ(built->over_budget, 0u);
  expect_sound(o.output, *shaped);
}

/// Fails whenever tiles with lakes have other bytes than they had. Then raise kShapeEpoch, unless
/// kTileEpoch was, and put the new digest here.
TEST(ShapeEpoch, is_raised_when_bytes_change) {
  ShapesFile water("epoch");
  water.polygon({test::square(-121.8, 46.8, 0.03)}).polygon({test::square(-121.7, 46.9, 0.011)});
  ShapeFiles files;
  files.flatten = files.water = {water.write()};
  const auto dem = DemSource::open(std::array{test::testdata("rainier.tif")});
  ASSERT_TRUE(dem) << dem.error().what;
  const auto shaped = shaped_dem(*dem, files);
  ASSERT_TRUE(shaped) << shaped.error().what;
  test::TempDir dir;
  BuildOptions o;
  o.output = dir.file("tiles");
  o.tiles.max_error_m = 60;
  ASSERT_TRUE(build_tiles(*shaped, o));
  std::string all;
  for (const auto& [name, bytes] : files_in(o.output)) all += bytes;
  EXPECT_EQ(kShapeEpoch, 6);
  EXPECT_EQ(hash128(all).text(), "cbaa92d5d25fd5c419cff034d32ac4ca")
      << "other bytes: raise kShapeEpoch";
}

/// Shapes of which lines run along tiles' borders, cross themselves at every turn, lie in one
/// another or go exactly through the DEM's outermost posts.
TEST(ShapedTiles, of_hard_shapes_are_level_and_have_no_cracks) {
  const auto dem = DemSource::open(std::array{test::testdata("rainier.tif")});
  ASSERT_TRUE(dem) << dem.error().what;
  const DemInfo& info = (*dem)->info();
  const GeoRect& b = info.bounds;
  const Vec2 middle{(b.west + b.east) / 2, (b.south + b.north) / 2};
  const auto ring = [&](double size, int points, int turn) {
    std::vector<Vec2> line;
    for (int k = 0; k < points; ++k) {
      const double a = 2 * M_PI * k * turn / points;
      line.push_back({middle.x + size * b.width() / 2 * std::cos(a),
                      middle.y + size * b.height() / 2 * std::sin(a)});
    }
    return line;
  };
  const std::vector<Vec2> outermost = {
      {b.west, b.south}, {b.east, b.south}, {b.east, b.north}, {b.west, b.north}};
  std::map<std::string, ShapesFile> shapes;
  shapes.try_emplace("star", "star").first->second.polygon({ring(0.7, 41, 19)});
  shapes.try_emplace("outermost", "outermost").first->second.polygon({outermost});
  shapes.try_emplace("nested", "nested")
      .first->second.polygon({ring(0.8, 60, 1), ring(0.6, 60, 1)})
      .polygon({ring(0.4, 60, 1), ring(0.2, 60, 1)})
      .polygon({ring(0.1, 30, 1)});
  for (auto& [name, file] : shapes) {
    ShapeFiles files;
    files.flatten = {file.write()};
    const auto shaped = shaped_dem(*dem, files);
    ASSERT_TRUE(shaped) << name << ": " << shaped.error().what;
    test::TempDir folder;
    BuildOptions o;
    o.output = folder.file("tiles");
    o.tiles.max_error_m = 4;
    o.threads = 2;
    const auto built = build_tiles(*shaped, o);
    ASSERT_TRUE(built) << name << ": " << built.error().what;
    EXPECT_EQ(built->without_lines, 0u) << name;
    CheckOptions options;
    options.source = *shaped;
    const auto report = check_tiles(o.output, options);
    ASSERT_TRUE(report) << name << ": " << report.error().what;
    EXPECT_TRUE(report->ok()) << name;
    for (const CheckLevel& level : report->levels) EXPECT_EQ(level.crack_m, 0) << name;
  }
}

/// Where a DEM ends, tiles follow the border of the child that is there: water stays level all the
/// same, at a level that is no multiple of the levels' steps.
TEST(ShapedTiles, over_the_rim_of_the_dem_are_level) {
  const auto dem = DemSource::open(std::vector{test::testdata("bigtujunga_crop.tif")},
                                   {.from_datum = VerticalDatum::egm96,
                                    .to_datum = TargetDatum::ellipsoid_if_known,
                                    .environment = test::environment()});
  ASSERT_TRUE(dem) << dem.error().what;
  constexpr double kSide = 0.015;
  ShapesFile lakes("rim");
  for (const Vec2& corner : {Vec2{-118.1864, 34.3076}, Vec2{-118.1256, 34.3299},
                             Vec2{-118.1633, 34.3464}, Vec2{-118.144, 34.2972}})
    lakes.polygon({test::square(corner.x, corner.y, kSide)});
  ShapeFiles files;
  files.flatten = {lakes.write()};
  const auto shaped = shaped_dem(*dem, files);
  ASSERT_TRUE(shaped) << shaped.error().what;
  test::TempDir folder;
  BuildOptions o;
  o.output = folder.file("tiles");
  o.tiles.max_error_m = 4;
  o.threads = 2;
  const auto built = build_tiles(*shaped, o);
  ASSERT_TRUE(built) << built.error().what;
  expect_sound(o.output, *shaped);
}

TEST(ShapedTiles, are_level_by_every_method) {
  ShapesFile water("methods");
  lakes(water);
  ShapeFiles files;
  files.flatten = {water.write()};
  const auto shaped = shaped_dem(hills(), files);
  ASSERT_TRUE(shaped) << shaped.error().what;
  for (const MethodOptions& method : all_methods()) {
    if (!check_tile_method(method)) continue;
    test::TempDir folder;
    BuildOptions o;
    o.output = folder.file("tiles");
    o.tiles.method = method;
    o.tiles.max_error_m = 2;
    o.threads = 2;
    const auto built = build_tiles(*shaped, o);
    ASSERT_TRUE(built) << method_text(method) << ": " << built.error().what;
    CheckOptions options;
    options.source = *shaped;
    const auto report = check_tiles(folder.file("tiles"), options);
    ASSERT_TRUE(report) << report.error().what;
    EXPECT_TRUE(report->ok()) << method_text(method);
    EXPECT_EQ(report->findings[rule("source.flat")].count, 0u) << method_text(method);
  }
}

TEST(ShapedTiles, have_the_water_of_their_place) {
  ShapesFile water("mask");
  lakes(water);
  ShapeFiles files;
  files.water = {water.write()};
  const auto shaped = shaped_dem(hills(), files);
  ASSERT_TRUE(shaped) << shaped.error().what;
  test::TempDir folder;
  build(*shaped, folder.file("tiles"), 2);
  std::size_t uniform = 0, mixed = 0;
  for (const auto& [name, bytes] : files_in(folder.file("tiles"))) {
    const auto tile =
        decode_tile({}, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    ASSERT_TRUE(tile);
    ++(tile->water_mask.size() == 1 ? uniform : mixed);
    EXPECT_TRUE(tile->water_mask.size() == 1 || tile->water_mask.size() == 65536) << name;
  }
  EXPECT_GT(uniform, 0u);
  EXPECT_GT(mixed, 0u);
}

TEST(ShapedTiles, the_checker_sees_tiles_that_were_made_without_the_lakes) {
  ShapesFile water("without");
  lakes(water);
  test::TempDir folder;
  build(hills(), folder.file("tiles"), 2);
  ShapeFiles files;
  files.flatten = files.water = {water.write()};
  const auto shaped = shaped_dem(hills(), files);
  ASSERT_TRUE(shaped);
  CheckOptions options;
  options.source = *shaped;
  const auto report = check_tiles(folder.file("tiles"), options);
  ASSERT_TRUE(report);
  EXPECT_GT(report->findings[rule("source.flat")].count, 0u);
  EXPECT_GT(report->findings[rule("source.water")].count, 0u);
}

TEST(ShapedTiles, other_lakes_are_refused_and_lines_want_both_sides) {
  ShapesFile water("first"), other("other");
  lakes(water);
  other.polygon({blob(11.25, 45, 0.01, 30)});
  ShapeFiles files;
  files.flatten = {water.write()};
  const auto shaped = shaped_dem(hills(), files);
  files.flatten = {other.write()};
  const auto changed = shaped_dem(hills(), files);
  ASSERT_TRUE(shaped && changed);
  test::TempDir folder;
  build(*shaped, folder.file("tiles"), 2);
  BuildOptions o;
  o.output = folder.file("tiles");
  EXPECT_EQ(build_tiles(*changed, o).error().code, Errc::invalid_argument);
  EXPECT_EQ(build_tiles(hills(), o).error().code, Errc::invalid_argument);
  o.force = true;
  EXPECT_TRUE(build_tiles(*changed, o));
  o.tiles.side = Side::above;
  EXPECT_EQ(build_tiles(*changed, o).error().code, Errc::invalid_argument);
}

}  // namespace
}  // namespace tind
