// Whole pyramids: every tile of every level is decoded and held against its neighbours, against the
// rules of a valid mesh and against the posts of its DEM.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string_view>
#include <thread>

#include "proto/tile/quantized_mesh.h"
#include "terrain/base/parallel.h"
#include "terrain/check/check.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/pyramid/plan/tile_version.h"
#include "terrain/store/folder/tile_ledger.h"
#include "terrain/store/open/stored_tiles.h"
#include "tests/support/layered_world.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::TempDir;

std::shared_ptr<const DemSource> open_dem(const std::vector<std::string>& files) {
  auto source = DemSource::open(files);
  if (!source) throw std::runtime_error(source.error().what);
  return *source;
}

std::vector<std::uint8_t> read_bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

using Pyramid = std::map<TileId, proto::QuantizedMesh>;

Pyramid decode_all(const std::string& directory) {
  Pyramid tiles;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(directory)) {
    if (entry.path().extension() != ".terrain") continue;
    const auto relative = std::filesystem::relative(entry.path(), directory);
    auto part = relative.begin();
    const int z = std::stoi(part->string());
    const int x = std::stoi((++part)->string());
    const int y = std::stoi((++part)->stem().string());
    auto mesh = proto::decode(read_bytes(entry.path()));
    EXPECT_TRUE(mesh) << relative << ": " << mesh.error().what;
    if (mesh) tiles.emplace(*tiling::tile(z, x, y), std::move(*mesh));
  }
  return tiles;
}

double height(const proto::QuantizedMesh& q, std::size_t i) {
  return q.min_height + q.h[i] * ((double(q.max_height) - q.min_height) / 32767);
}

/// Position along the side -> decoded height and normal.
using SideLine = std::map<int, std::pair<double, std::array<std::uint8_t, 2>>>;
SideLine side_line(const proto::QuantizedMesh& q, const std::vector<std::uint32_t>& side,
                   bool by_u) {
  SideLine line;
  for (const auto i : side) line[by_u ? q.u[i] : q.v[i]] = {height(q, i), q.oct_normals[i]};
  return line;
}

void expect_no_cracks(const Pyramid& tiles) {
  std::size_t pairs = 0;
  for (const auto& [id, q] : tiles) {
    const auto east = tiles.find(TileId{id.level, (id.x + 1) % tiling::columns(id.level), id.y});
    if (east != tiles.end() && east->first != id) {
      EXPECT_EQ(side_line(q, q.east, false), side_line(east->second, east->second.west, false))
          << id.text() << " east";
      ++pairs;
    }
    const auto north = tiles.find(TileId{id.level, id.x, id.y + 1});
    if (north != tiles.end()) {
      EXPECT_EQ(side_line(q, q.north, true), side_line(north->second, north->second.south, true))
          << id.text() << " north";
      ++pairs;
    }
  }
  EXPECT_GT(pairs, tiles.size() / 2);
}

void expect_valid(const TileId& id, const proto::QuantizedMesh& q) {
  std::int64_t area = 0;
  for (const auto& t : q.triangles) {
    const std::int64_t ax = q.u[t[0]], ay = q.v[t[0]];
    const std::int64_t twice =
        (q.u[t[1]] - ax) * (q.v[t[2]] - ay) - (q.v[t[1]] - ay) * (q.u[t[2]] - ax);
    ASSERT_GT(twice, 0) << id.text();
    area += twice;
  }
  EXPECT_EQ(area, std::int64_t(2) * 32767 * 32767) << id.text();
}

/// The largest error over all posts in the tile, straight from the definition.
double true_error(const DemSource& source, const TileId& id, const proto::QuantizedMesh& q) {
  const GeoRect rect = tiling::rect(id);
  const DemInfo& info = source.info();
  const auto grid = source.read(0, 0, int(info.cols), int(info.rows));
  std::vector<Vec2> posts;
  for (int r = 0; r < info.rows; ++r)
    for (int c = 0; c < info.cols; ++c) posts.push_back({double(c), double(r)});
  std::vector<Geographic> places(posts.size());
  source.to_geographic(posts, places);
  double worst = 0;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const float z = grid->values()[k];
    if (std::isnan(z) || !rect.contains(places[k])) continue;
    const double u = (places[k].lon - rect.west) / rect.width() * 32767;
    const double v = (places[k].lat - rect.south) / rect.height() * 32767;
    bool covered = false;
    for (const auto& t : q.triangles) {
      const double ax = q.u[t[0]], ay = q.v[t[0]], bx = q.u[t[1]], by = q.v[t[1]];
      const double cx = q.u[t[2]], cy = q.v[t[2]];
      const double area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
      const double wa = ((bx - u) * (cy - v) - (by - v) * (cx - u)) / area;
      const double wb = ((cx - u) * (ay - v) - (cy - v) * (ax - u)) / area;
      const double wc = 1 - wa - wb;
      if (wa < -1e-9 || wb < -1e-9 || wc < -1e-9) continue;
      covered = true;
      worst = std::max(
          worst, std::abs(wa * height(q, t[0]) + wb * height(q, t[1]) + wc * height(q, t[2]) - z));
    }
    EXPECT_TRUE(covered) << id.text();
  }
  return worst;
}

double stated_error(const proto::QuantizedMesh& q) {
  return nlohmann::json::parse(q.metadata)["max_error_m"];
}

/// CesiumJS learns from the metadata of every tenth level which tiles there are.
void expect_metadata_lists_every_tile(const Pyramid& tiles) {
  std::vector<TileId> listed;
  for (const auto& [id, q] : tiles) {
    const auto metadata = nlohmann::json::parse(q.metadata);
    ASSERT_EQ(metadata.contains("available"), id.level % 10 == 0) << id.text();
    if (id.level % 10 != 0) continue;
    int level = id.level;
    for (const auto& ranges : metadata["available"]) {
      ++level;
      for (const auto& r : ranges)
        for (std::uint32_t x = r["startX"]; x <= r["endX"]; ++x)
          for (std::uint32_t y = r["startY"]; y <= r["endY"]; ++y) listed.push_back({level, x, y});
    }
  }
  std::ranges::sort(listed);
  std::vector<TileId> below_the_roots;
  for (const auto& [id, q] : tiles)
    if (id.level > 0) below_the_roots.push_back(id);
  EXPECT_EQ(listed, below_the_roots);
}

void check_pyramid(const std::vector<std::string>& files, const TileSetOptions& options,
                   std::size_t every) {
  const auto source = open_dem(files);
  TempDir dir;
  BuildOptions o;
  o.tiles = options;
  o.output = dir.file("tiles");
  const auto report = build_tiles(source, o);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->over_budget, 0u) << report->worst_over_budget;
  const Pyramid tiles = decode_all(o.output);
  ASSERT_EQ(tiles.size(), report->tiles);
  expect_no_cracks(tiles);
  // Gaps between levels: there are some, also where data end, and none is larger than is stated.
  const auto checked = check_tiles(o.output, {});
  ASSERT_TRUE(checked) << checked.error().what;
  EXPECT_EQ(checked->findings.total(Severity::violation), 0u);
  EXPECT_EQ(checked->findings.total(Severity::warning), 0u);
  EXPECT_GT(checked->levels.back().gap_m, 0);
  EXPECT_GT(report->levels.back().worst_edge_error_m, 0);
  expect_metadata_lists_every_tile(tiles);
  std::size_t n = 0;
  const int source_levels = tiles.rbegin()->first.level + 1;
  for (const auto& [id, q] : tiles) {
    expect_valid(id, q);
    // Brute force: only where a tile holds few enough posts.
    if (id.level + 3 > source_levels && n++ % every == 0) {
      EXPECT_LE(true_error(*source, id, q), stated_error(q) + 1e-9) << id.text();
    }
    EXPECT_LE(stated_error(q), tiling::level_error(id.level) + 1e-6);
  }
}

TEST(Tiles, geographic_pyramid_is_valid_without_cracks_and_within_its_errors) {
  TileSetOptions options;
  options.max_error_m = 20;
  check_pyramid({test::testdata("rainier.tif")}, options, 25);
}

TEST(Tiles, projected_pyramid_is_valid_without_cracks_and_within_its_errors) {
  check_pyramid({test::testdata("bigtujunga_crop.tif")}, {}, 20);
}

/// What `side` promises, straight from the definition, by the checker that shares no code with what
/// makes tiles; and the side in tile and layer.
void check_one_sided(const std::string& file, Side side, double max_error) {
  const auto source = open_dem({file});
  TempDir dir;
  BuildOptions o;
  o.tiles.side = side;
  o.tiles.max_error_m = max_error;
  o.tiles.effort = Effort::fast;
  o.output = dir.file("tiles");
  const auto report = build_tiles(source, o);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->not_one_sided, 0u);
  EXPECT_EQ(report->over_budget, 0u);
  CheckOptions check;
  check.source = source;
  const auto checked = check_tiles(o.output, check);
  ASSERT_TRUE(checked) << checked.error().what;
  EXPECT_EQ(checked->findings.total(Severity::violation), 0u);
  const auto layer = nlohmann::json::parse(read_bytes(o.output + "/layer.json"));
  EXPECT_EQ(layer["side"], side == Side::above ? "above" : "below");
  const auto on_demand = open_dem_tiles(source, o.tiles);
  ASSERT_TRUE(on_demand);
  std::size_t n = 0;
  for (const auto& [id, q] : decode_all(o.output)) {
    EXPECT_EQ(nlohmann::json::parse(q.metadata)["side"], side == Side::above ? "above" : "below")
        << id.text();
    if (n++ % 7 == 0) {
      EXPECT_EQ(read_bytes(o.output + "/" + id.text() + ".terrain"),
                (*on_demand)->tile(id, {})->bytes);
    }
  }
}

TEST(Tiles, one_sided_tiles_of_a_geographic_dem) {
  check_one_sided(test::testdata("rainier.tif"), Side::above, 40);
  check_one_sided(test::testdata("rainier.tif"), Side::below, 40);
}

TEST(Tiles, one_sided_tiles_of_a_projected_dem) {
  check_one_sided(test::testdata("bigtujunga_crop.tif"), Side::above, 5);
  check_one_sided(test::testdata("bigtujunga_crop.tif"), Side::below, 5);
}

TEST(Tiles, two_adjacent_rasters_make_one_seamless_pyramid) {
  TIND_NEEDS_SHARED_DATA(west, "dem/N49W124.tif");
  TIND_NEEDS_SHARED_DATA(east, "dem/N49W123.tif");
  TileSetOptions options;
  options.max_error_m = 18;
  check_pyramid({west, east}, options, 200);
}

TEST(Tiles, same_bytes_for_any_number_of_threads_shuffled_on_demand_and_after_stops) {
  const auto source = open_dem({test::testdata("rainier.tif")});
  TempDir dir;
  BuildOptions o;
  o.tiles.max_error_m = 40;
  using Bytes = std::map<TileId, std::vector<std::uint8_t>>;
  std::set<Bytes> seen;
  std::vector<TileId> ids;
  const auto add_directory = [&] {
    Bytes tiles;
    for (const auto& [id, q] : decode_all(o.output))
      tiles[id] = read_bytes(o.output + "/" + id.text() + ".terrain");
    if (ids.empty())
      for (const auto& [id, bytes] : tiles) ids.push_back(id);
    EXPECT_EQ(tiles.size(), ids.size());
    seen.insert(std::move(tiles));
  };
  for (const int threads : {1, 2, 4, 16}) {
    if (test::kSanitized && threads == 2) continue;
    o.output = dir.file(std::to_string(threads));
    o.threads = threads;
    ASSERT_TRUE(build_tiles(source, o));
    add_directory();
  }
  o.output = dir.file("stopped");
  for (double until = 0.1;; until += 0.3) {
    std::stop_source stop;
    Progress progress;
    progress.stop = stop.get_token();
    progress.report = [&](double share) {
      if (share > until) stop.request_stop();
    };
    if (build_tiles(source, o, progress)) break;
    ASSERT_LT(until, 2);
  }
  add_directory();

  ASSERT_GT(ids.size(), 100u);
  std::mt19937 random(7);
  std::ranges::shuffle(ids, random);
  const auto on_demand = open_dem_tiles(source, o.tiles);
  ASSERT_TRUE(on_demand);
  std::vector<std::vector<std::uint8_t>> made(ids.size());
  parallel_for(ids.size(), 3, [&](std::size_t i) {
    if (auto tile = (*on_demand)->tile(ids[i], {})) made[i] = std::move(tile->bytes);
  });
  Bytes tiles;
  for (std::size_t i = 0; i < ids.size(); ++i) tiles[ids[i]] = made[i];
  seen.insert(std::move(tiles));
  EXPECT_EQ(seen.size(), 1u);
}

TEST(Tiles, a_build_that_was_stopped_goes_on_and_ends_the_same) {
  const auto source = open_dem({test::testdata("rainier.tif")});
  TempDir dir;
  BuildOptions o;
  o.tiles.max_error_m = 40;
  o.output = dir.file("whole");
  const auto whole = build_tiles(source, o);
  ASSERT_TRUE(whole);
  o.output = dir.file("resumed");
  std::stop_source stop;
  Progress progress;
  progress.stop = stop.get_token();
  progress.report = [&](double share) {
    if (share > 0.4) stop.request_stop();
  };
  const auto stopped = build_tiles(source, o, progress);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::cancelled);
  EXPECT_FALSE(std::filesystem::exists(o.output + "/layer.json"));
  const auto resumed = build_tiles(source, o);
  ASSERT_TRUE(resumed);
  EXPECT_GT(resumed->reused, 0u);
  EXPECT_GT(resumed->built, 0u);
  for (const auto& [id, q] : decode_all(o.output)) {
    EXPECT_EQ(read_bytes(dir.file("whole/" + id.text() + ".terrain")),
              read_bytes(dir.file("resumed/" + id.text() + ".terrain")));
  }
  EXPECT_EQ(read_bytes(dir.file("whole/layer.json")), read_bytes(dir.file("resumed/layer.json")));
}

TEST(Tiles, a_directory_of_other_options_is_refused) {
  const auto source = open_dem({test::testdata("rainier.tif")});
  TempDir dir;
  BuildOptions o;
  o.tiles.max_error_m = 100;
  o.tiles.max_level = 6;
  o.output = dir.file("tiles");
  ASSERT_TRUE(build_tiles(source, o));
  o.tiles.max_error_m = 50;
  const auto other = build_tiles(source, o);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, Errc::invalid_argument);
  o.force = true;
  EXPECT_TRUE(build_tiles(source, o));
}

/// Every tile file of a folder.
std::map<TileId, std::vector<std::uint8_t>> tile_files(const std::string& folder) {
  std::map<TileId, std::vector<std::uint8_t>> files;
  for (const auto& [id, q] : decode_all(folder))
    files[id] = read_bytes(folder + "/" + id.text() + ".terrain");
  return files;
}

TEST(Tiles, levels_that_are_made_apart_are_those_of_the_whole_pyramid) {
  const auto source = open_dem({test::testdata("rainier.tif")});
  TempDir dir;
  for (const std::int64_t exact_posts : {0, 1 << 16}) {  // 1 << 16: coarse ones rest on the index
    BuildOptions o;
    o.tiles.max_error_m = 40;
    o.tiles.exact_posts = exact_posts;
    o.output = dir.file("whole" + std::to_string(exact_posts));
    const auto whole = build_tiles(source, o);
    ASSERT_TRUE(whole) << whole.error().what;
    EXPECT_EQ(whole->indexed_level >= 0, exact_posts > 0);
    const int end = whole->levels.back().level;
    std::map<TileId, std::vector<std::uint8_t>> parts;
    // A cut at each level that could look at another: those of the index, the one below, the last.
    std::vector<int> starts = {0, 6, end};
    if (exact_posts > 0) starts = {0, whole->indexed_level + 1, whole->indexed_level + 2};
    for (std::size_t i = 0; i < starts.size(); ++i) {
      BuildOptions part = o;
      part.output = dir.file("part" + std::to_string(exact_posts) + "-" + std::to_string(i));
      part.tiles.first_level = starts[i];
      part.tiles.last_level = i + 1 < starts.size() ? starts[i + 1] - 1 : -1;
      const auto report = build_tiles(source, part);
      ASSERT_TRUE(report) << report.error().what;
      parts.merge(tile_files(part.output));
      const auto tiles = open_stored_tiles(part.output);
      ASSERT_TRUE(tiles) << tiles.error().what;
      EXPECT_EQ((*tiles)->layer().minzoom, starts[i]);
      EXPECT_EQ((*tiles)->layer().maxzoom, i + 1 < starts.size() ? starts[i + 1] - 1 : end);
      const auto on_demand = open_dem_tiles(source, part.tiles);
      ASSERT_TRUE(on_demand);
      for (const auto& [id, bytes] : parts)
        EXPECT_EQ((*on_demand)->available(id), (*tiles)->available(id)) << id.text();
    }
    EXPECT_EQ(parts, tile_files(o.output));
  }
}

TEST(Tiles, the_version_follows_the_content_and_is_the_same_in_a_batch_and_on_demand) {
  const TempDir dir;
  const auto dem = [&](const std::string& post) {
    const std::string path = dir.file("dem.asc");
    std::ofstream(path) << "ncols 4\nnrows 2\nxllcenter 10\nyllcenter 50\ncellsize 0.01\n"
                        << "1 2 3 4\n5 6 7 " << post << "\n";
    std::ofstream(dir.file("dem.prj"))
        << R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,)"
        << R"(298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
    return open_dem({path});
  };
  std::set<std::string> seen;
  int builds = 0;
  const auto version = [&](const std::string& post, const TileSetOptions& options) {
    const auto source = dem(post);
    BuildOptions o;
    o.tiles = options;
    o.output = dir.file("tiles" + std::to_string(builds++));
    const auto report = build_tiles(source, o);
    EXPECT_TRUE(report) << report.error().what;
    const auto batch = open_stored_tiles(o.output);
    const auto on_demand = open_dem_tiles(source, options);
    EXPECT_EQ((*batch)->layer().version, (*on_demand)->layer().version);
    // What is not read at once has a version, too, that does not change under a client's eyes.
    const auto later = open_dem_tiles(source, options, 0);
    const std::string before = (*later)->layer().version;
    while ((*later)->readiness().state == Readiness::State::reading) std::this_thread::yield();
    EXPECT_EQ((*later)->layer().version, before);
    EXPECT_THAT((*batch)->layer().version, testing::MatchesRegex("[0-9]+\\.0\\.[0-9]+"));
    EXPECT_THAT(before, testing::MatchesRegex("[0-9]+\\.0\\.[0-9]+"));
    return (*batch)->layer().version;
  };
  TileSetOptions options;
  options.max_level = 4;
  seen.insert(version("8", options));
  EXPECT_TRUE(seen.contains(version("8", options)));
  TileSetOptions part = options;
  part.first_level = 2;
  EXPECT_TRUE(seen.contains(version("8", part)));
  EXPECT_TRUE(seen.insert(version("9", options)).second);
  options.max_error_m = 3;
  EXPECT_TRUE(seen.insert(version("9", options)).second);
  options.max_level = 3;
  EXPECT_TRUE(seen.insert(version("9", options)).second);
}

/// Fails whenever tiles' bytes are others than they were. Then raise kTileEpoch, so that nobody's
/// folders and caches mix them, and put the new digest here.
TEST(TileEpoch, is_raised_when_bytes_change) {
  TempDir dir;
  BuildOptions o;
  o.output = dir.file("tiles");
  o.tiles.max_error_m = 60;
  o.tiles.effort = Effort::fast;
  std::string all;
  for (const std::int64_t exact_posts : {0, 1 << 16}) {
    o.output = dir.file(std::to_string(exact_posts));
    o.tiles.exact_posts = exact_posts;
    ASSERT_TRUE(build_tiles(open_dem({test::testdata("rainier.tif")}), o));
    for (const auto& [id, bytes] : tile_files(o.output)) all.append(bytes.begin(), bytes.end());
  }
  LedgerEntry digest;
  digest.take(all);
  EXPECT_EQ(kTileEpoch, 10);
  EXPECT_EQ(digest.hash_low, 7345045336955075562u) << "other bytes: raise kTileEpoch";
}

/// At the edge of a DEM, of so many posts that a fit sees every second or fourth one first.
TEST(Tiles, a_spike_that_no_first_fit_sees_is_within_the_budget) {
  HeightGrid grid(1700, 1700, 0);
  for (const auto& [col, row] : {std::pair{851, 850}, {850, 851}, {851, 851}, {853, 855}})
    grid.at(col, row) = 1000;
  const auto source =
      std::make_shared<test::MadeUpSource>(std::move(grid), Geographic{7.1, 46.6}, 1.0 / 3600);
  TempDir dir;
  BuildOptions o;
  o.output = dir.file("tiles");
  o.tiles.first_level = o.tiles.last_level = 8;
  const auto report = build_tiles(source, o);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->over_budget, 0u) << report->worst_over_budget_m;
  EXPECT_LE(report->levels[8].worst_error_m, report->levels[8].budget_m);
}

/// One post as high as a mountain, where the grid of a coarse tile has a dozen units between posts,
/// and noise: what a mesh within the budget needs are other edges, not more vertices.
TEST(Tiles, steep_posts_a_few_units_apart_are_within_the_budget) {
  HeightGrid peak(3, 3, 0), low_peak(3, 3, 0);
  peak.at(1, 1) = 9000, low_peak.at(1, 1) = 4000;
  const std::shared_ptr<const DemSource> sources[] = {
      std::make_shared<test::MadeUpSource>(peak, Geographic{10.3105, 47.0225}, 0.001),
      std::make_shared<test::MadeUpSource>(low_peak, Geographic{10.01015, 45.02075}, 0.0003)};
  for (const auto& source : sources) {
    TempDir dir;
    BuildOptions o;
    o.output = dir.file("tiles");
    o.tiles.first_level = 0, o.tiles.last_level = 9;  // deeper, the grid is too coarse indeed
    const auto report = build_tiles(source, o);
    ASSERT_TRUE(report) << report.error().what;
    EXPECT_EQ(report->over_budget, 0u) << report->worst_over_budget_m;
    test::expect_no_violation(o.output, Surface(source));
  }
}

/// What is asked for is less than what the places of posts are known within: such tiles end, too.
TEST(Tiles, posts_a_micrometre_apart_end) {
  TempDir dir;
  BuildOptions o;
  o.output = dir.file("tiles");
  o.tiles.first_level = o.tiles.last_level = 24;
  const auto report =
      build_tiles(std::make_shared<test::MadeUpSource>(test::rough_terrain(24, 24, 3, 300),
                                                       Geographic{7.1, 46.6}, 1e-11, 0.1),
                  o);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_GT(report->tiles, 0u);
}

/// The same beside the edge of tiles, on which posts lie: what is done for it stops short of the
/// edge, so that neighbours meet, whether the budget is kept or not.
TEST(Tiles, steep_posts_beside_an_edge_leave_it_as_it_is) {
  for (const double step : {0.0003, 0.001, 0.002}) {
    HeightGrid grid = test::rough_terrain(12, 12, 3, 300);
    grid.at(6, 6) = 9000;
    const auto source = std::make_shared<test::MadeUpSource>(
        std::move(grid), Geographic{-5 * step, 47.0205 + 11 * step}, step);
    TempDir dir;
    BuildOptions o;
    o.output = dir.file("tiles");
    o.tiles.first_level = 0, o.tiles.last_level = 9;
    ASSERT_TRUE(build_tiles(source, o));
    const auto checked = check_tiles(o.output, {.threads = 2, .source = Surface(source)});
    ASSERT_TRUE(checked) << checked.error().what;
    for (std::size_t rule = 0; rule < kCheckRuleCount; ++rule) {
      const std::string_view id = kCheckRules[rule].id;
      if (kCheckRules[rule].severity != Severity::violation || id.starts_with("error.")) continue;
      EXPECT_EQ(checked->findings[rule].count, 0u) << step << " " << id;
    }
  }
}

/// Heights of Mars, or of feet that are taken for metres: headers of tiles are floats, which have
/// no thousandths of a metre there.
TEST(Tiles, heights_beyond_sixteen_kilometres_are_stated_as_clients_decode_them) {
  for (const double base : {16'350.0, 21'229.3, 29'029.0, -21'000.0})
    for (const Side side : {Side::both, Side::above}) {
      HeightGrid grid = test::rough_terrain(120, 120, 5, 7);
      for (float& z : grid.values()) z += float(base);
      const auto source =
          std::make_shared<test::MadeUpSource>(std::move(grid), Geographic{7.1, 46.6}, 0.0002);
      TempDir dir;
      BuildOptions o;
      o.output = dir.file("tiles");
      o.tiles.side = side;
      const auto report = build_tiles(source, o);
      ASSERT_TRUE(report) << report.error().what;
      SCOPED_TRACE(base);
      test::expect_no_violation(o.output, Surface(source));
    }
}

TEST(Tiles, a_pyramid_that_ends_elsewhere_has_its_bound_there) {
  const auto source = open_dem({test::testdata("rainier.tif")});
  TempDir dir;
  BuildOptions o;
  o.tiles.max_error_m = 40;
  o.tiles.max_level = 7;
  o.output = dir.file("short");
  const auto report = build_tiles(source, o);
  ASSERT_TRUE(report) << report.error().what;
  EXPECT_EQ(report->levels.back().level, 7);
  EXPECT_EQ(report->levels.back().budget_m, 40);
  o.tiles.first_level = 8;
  const auto beyond = build_tiles(source, o);
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().code, Errc::invalid_argument);
  EXPECT_NE(beyond.error().what.find("ends at level 7"), std::string::npos) << beyond.error().what;
}

TEST(Tiles, a_dem_without_crs_cannot_be_tiled) {
  const auto tiles = open_dem_tiles(open_dem({test::testdata("crater.tif")}), {});
  ASSERT_FALSE(tiles);
  EXPECT_EQ(tiles.error().code, Errc::unsupported);
  EXPECT_NE(tiles.error().what.find("coordinate reference system"), std::string::npos);
}

}  // namespace
}  // namespace tind
