// Pyramids whose coarse tiles rest on the residual index: the same promises as of any others. Small
// sources are made to need one.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "proto/tile/quantized_mesh.h"
#include "terrain/check/check.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using test::TempDir;

std::shared_ptr<const DemSource> open_dem(const std::string& name) {
  auto source = DemSource::open(std::vector<std::string>{test::testdata(name)});
  if (!source) throw std::runtime_error(source.error().what);
  return *source;
}

std::string read_bytes(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// Every tile, by name.
std::map<std::string, std::string> tiles_in(const std::string& directory) {
  std::map<std::string, std::string> tiles;
  for (const auto& entry : fs::recursive_directory_iterator(directory))
    if (entry.path().extension() == ".terrain")
      tiles[fs::relative(entry.path(), directory).string()] = read_bytes(entry.path());
  return tiles;
}

BuildOptions options(const std::string& output, double max_error, int exact_posts = 1 << 16) {
  BuildOptions o;
  o.tiles.max_error_m = max_error;
  o.tiles.exact_posts = exact_posts;
  o.output = output;
  return o;
}

/// Builds, and has the checker measure every tile over every post.
void expect_certified(const std::shared_ptr<const DemSource>& source, BuildOptions o) {
  const TempDir dir;
  o.output = dir.file("tiles");
  const auto report = build_tiles(source, o);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_TRUE(report->index_made);
  EXPECT_GT(report->index_bytes, 0u);
  EXPECT_EQ(report->over_budget, 0u);
  std::size_t bounds = 0;
  for (const auto& [name, bytes] : tiles_in(o.output)) {
    const auto mesh =
        proto::decode({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    ASSERT_TRUE(mesh) << name << ": " << mesh.error().what;
    const auto metadata = nlohmann::json::parse(mesh->metadata);
    if (!metadata.contains("residual_m")) continue;
    ++bounds;
    EXPECT_EQ(metadata["error_kind"], "bound") << name;
    EXPECT_GE(metadata["max_error_m"], metadata["residual_m"]) << name;
  }
  // About one a level at least; where the bound would break the budget, posts are read after all.
  EXPECT_GE(bounds, std::size_t(report->indexed_level) / 2);
  CheckOptions check;
  check.source = source;
  const auto checked = check_tiles(o.output, check);
  ASSERT_TRUE(checked) << checked.error().what;
  EXPECT_EQ(checked->findings.total(Severity::violation), 0u);
  for (const CheckLevel& level : checked->levels) {
    EXPECT_GT(level.posts, 0u);
    EXPECT_LE(level.measured_m, level.stated_m);
  }
}

TEST(IndexedTiles, keep_their_word_over_every_post) {
  expect_certified(open_dem("rainier.tif"), options("", 20));  // with voids
}

/// Budgets of the first levels are larger than any heights.
TEST(IndexedTiles, of_continents_keep_it_too) {
  const auto source = std::make_shared<const test::MadeUpSource>(
      test::terrain_with_voids(512, 211, 3, 10'000), Geographic{-120, 50}, 240.0 / 512);
  BuildOptions o = options("", 2000, 1 << 12);
  o.tiles.max_level = 3;
  expect_certified(source, o);
  o.tiles.method = QemOptions{};
  expect_certified(source, o);
}

TEST(IndexedTiles, of_a_projected_source_too) {
  expect_certified(open_dem("bigtujunga_crop.tif"), options("", 5, 1 << 12));
}

TEST(IndexedTiles, are_the_same_for_any_number_of_threads_after_stops_and_on_demand) {
  const auto source = open_dem("rainier.tif");
  const TempDir dir;
  BuildOptions o = options(dir.file("one"), 80);
  o.threads = 1;
  ASSERT_TRUE(build_tiles(source, o));
  const auto wanted = tiles_in(o.output);

  o = options(dir.file("stopped"), 80);
  o.threads = 3;
  int tries = 0;
  for (double until = 0.1;; until += 0.15) {  // the first time while the index is made
    std::stop_source stop;
    Progress progress;
    progress.stop = stop.get_token();
    progress.report = [&](double share) {
      if (share > until) stop.request_stop();
    };
    const auto report = build_tiles(source, o, progress);
    if (report) break;
    EXPECT_EQ(report.error().code, Errc::cancelled);
    ASSERT_LT(++tries, 20);
  }
  EXPECT_GT(tries, 1);
  EXPECT_EQ(tiles_in(o.output), wanted);

  const auto on_demand = open_dem_tiles(source, o.tiles);
  ASSERT_TRUE(on_demand);
  for (const auto& [name, bytes] : wanted) {
    int z = 0, x = 0, y = 0;
    ASSERT_EQ(std::sscanf(name.c_str(), "%d/%d/%d", &z, &x, &y), 3);
    if (z > 10 && (x + y) % 5 != 0) continue;
    const auto tile = (*on_demand)->tile(*tiling::tile(z, x, y), {});
    ASSERT_TRUE(tile) << tile.error().what;
    EXPECT_EQ(std::string(tile->bytes.begin(), tile->bytes.end()), bytes) << name;
  }
}

TEST(IndexedTiles, a_damaged_index_is_made_anew) {
  const auto source = open_dem("rainier.tif");
  const TempDir dir;
  BuildOptions o = options(dir.file("tiles"), 80);
  o.tiles.max_level = 9;
  ASSERT_TRUE(build_tiles(source, o));
  const auto wanted = tiles_in(o.output);
  EXPECT_FALSE(build_tiles(source, o)->index_made);
  const std::string index = o.output + "/residuals.tind";
  fs::resize_file(index, fs::file_size(index) / 2);
  fs::remove_all(o.output + "/5");
  const auto report = build_tiles(source, o);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_TRUE(report->index_made);
  EXPECT_EQ(report->built, 1u);
  EXPECT_EQ(tiles_in(o.output), wanted);
}

}  // namespace
}  // namespace tind
