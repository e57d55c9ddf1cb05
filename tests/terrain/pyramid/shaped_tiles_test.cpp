// Pyramids with lakes: level, without cracks, certified, the same for any number of threads.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "terrain/check/check.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/plan/tile_method.h"
#include "terrain/shapes/shaped_dem.h"
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
  CheckOptions options;
  options.source = *shaped;
  const auto report = check_tiles(one.file("tiles"), options);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_TRUE(report->ok());
  for (const CheckLevel& level : report->levels) EXPECT_EQ(level.crack_m, 0);
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
