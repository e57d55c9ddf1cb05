// The residual index is believed by every tile that rests on it: so it is held against all posts.

#include "terrain/pyramid/residual/residual_index.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <stop_token>
#include <thread>
#include <vector>

#include "terrain/base/file_io.h"
#include "terrain/pyramid/plan/plan_source.h"
#include "terrain/pyramid/residual/residual_scan.h"
#include "terrain/surface/rim_samples.h"
#include "tests/support/layered_world.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::MadeUpSource;
using test::TempDir;

struct Post {
  double u, v, height;  // in tile coordinates
};

std::vector<Post> posts_of(const MadeUpSource& source, TileId id) {
  const GeoRect rect = tiling::rect(id);
  std::vector<Post> posts;
  for (int r = 0; r < source.grid().rows(); ++r)
    for (int c = 0; c < source.grid().cols(); ++c) {
      if (source.grid().is_void(c, r)) continue;
      const Vec2 p = source.info().post_to_crs.apply(c, r);
      const double u = (p.x - rect.west) / rect.width() * 32767,
                   v = (p.y - rect.south) / rect.height() * 32767;
      if (u < -1e-7 || v < -1e-7 || u > 32767 + 1e-7 || v > 32767 + 1e-7) continue;
      posts.push_back({u, v, source.grid().at(c, r)});
    }
  return posts;
}

/// The surface straight from its definition, in a cell.
double surface(const ResidualLattice& l, int col, int row, double u, double v) {
  const double side = 32767.0 / l.cells;
  const double s = u / side - col, t = v / side - (l.cells - 1 - row);
  const auto h = [&](int i, int j) {
    return double(l.heights[std::size_t((row + j) * l.nodes() + col + i)]);
  };
  const double sw = h(0, 1), se = h(1, 1), nw = h(0, 0), ne = h(1, 0);
  return t <= s ? sw * (1 - s) + se * (s - t) + ne * t : sw * (1 - t) + nw * (t - s) + ne * s;
}

/// No post is farther from the surface than its cell says; the largest error of any.
double expect_bounds_hold(const std::vector<Post>& posts, const ResidualLattice& lattice) {
  double worst = 0;
  for (const Post& p : posts) {
    const double side = 32767.0 / lattice.cells;
    const int col = std::min(lattice.cells - 1, int(std::max(0.0, p.u) / side));
    const int row = std::min(lattice.cells - 1, int(std::max(0.0, 32767 - p.v) / side));
    const float bound = lattice.residual[std::size_t(row * lattice.cells + col)];
    const double error = std::abs(surface(lattice, col, row, p.u, p.v) - p.height);
    EXPECT_GE(bound, 0) << "a cell with a post is called empty";
    EXPECT_LE(error, bound + 1e-9) << "at " << p.u << ", " << p.v;
    if (::testing::Test::HasFailure()) return 0;
    worst = std::max(worst, error);
  }
  return worst;
}

/// The same for a tile's own lattice, which may be looser by a factor, and for its finer one.
void expect_bounds_hold(const MadeUpSource& source, const ResidualIndex& index, TileId id,
                        double loosest) {
  SCOPED_TRACE(id.text());
  const auto record = index.record(id);
  ASSERT_TRUE(record) << record.error().what;
  const auto finer = index.lattice(id);
  ASSERT_TRUE(finer) << finer.error().what;
  EXPECT_EQ(finer->cells, 256 << std::min(1, index.level() - id.level));
  const auto posts = posts_of(source, id);
  EXPECT_EQ((*record)->posts(), posts.size());
  EXPECT_EQ(finer->posts, posts.size());
  const ResidualRecord* const only = record->get();
  const auto own = lattice_of({&only, 1}, index.depth().step_m());
  EXPECT_LE(own.largest_residual(), loosest * expect_bounds_hold(posts, own) + 1e-6);
  expect_bounds_hold(posts, *finer);
  if (posts.empty()) return;
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const Post& p : posts) low = std::min(low, p.height), high = std::max(high, p.height);
  EXPECT_EQ(finer->min_m, low);
  EXPECT_EQ(finer->max_m, high);
}

std::shared_ptr<const ResidualIndex> index_of(const MadeUpSource& source, const TempDir& dir,
                                              int level, int threads = 2) {
  auto index = ResidualIndex::open_or_make(dir.file("index"), source, level, threads);
  EXPECT_TRUE(index) << index.error().what;
  return index ? *index : nullptr;
}

std::vector<TileId> tiles_over(const MadeUpSource& source, int level) {
  std::vector<TileId> ids;
  for (std::uint32_t y = 0; y < tiling::rows(level); ++y)
    for (std::uint32_t x = 0; x < tiling::columns(level); ++x)
      if (const auto id = tiling::tile(level, x, y);
          tiling::rect(*id).overlaps(source.info().bounds))
        ids.push_back(*id);
  return ids;
}

void expect_all_hold(const MadeUpSource& source, int deepest) {
  const TempDir dir;
  const auto index = index_of(source, dir, deepest);
  ASSERT_TRUE(index);
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const float z : source.grid().values())
    if (!std::isnan(z)) low = std::min<double>(low, z), high = std::max<double>(high, z);
  EXPECT_EQ(index->min_m(), low);
  EXPECT_EQ(index->max_m(), high);
  for (int z = deepest; z >= 0; --z)
    for (const TileId id : tiles_over(source, z))
      // Exact (but for 3.2 % of rounding) for five levels; a sum of bounds above.
      expect_bounds_hold(source, *index, id, deepest - z <= 5 ? 1.033 : 6);
}

TEST(ResidualIndex, bounds_every_post_of_a_plain_source) {
  // Tile sides fall between posts.
  expect_all_hold(MadeUpSource(test::terrain_with_voids(620, 500, 1), {10.123, 45.9}, 0.00131), 9);
}

TEST(ResidualIndex, bounds_every_post_where_posts_lie_on_the_sides_of_tiles) {
  // 45 degrees north, 11.25 east: sides of many levels; 128 posts to a tile of level 9.
  const double spacing = tiling::tile_degrees(9) / 128;
  expect_all_hold(MadeUpSource(test::terrain_with_voids(513, 385, 2),
                               {11.25 - 128 * spacing, 45 + 128 * spacing}, spacing),
                  9);
}

TEST(ResidualIndex, bounds_every_post_of_a_turned_source) {
  expect_all_hold(MadeUpSource(test::terrain_with_voids(400, 300, 3), {10.123, 45.9}, 0.00131, 0.3),
                  9);
}

TEST(ResidualIndex, bounds_every_post_of_one_that_spans_more_than_eight_levels) {
  // From level 12 up a cell of level 3 holds a whole tile: bounds of bounds of bounds.
  expect_all_hold(MadeUpSource(test::terrain_with_voids(700, 90, 4), {-0.7, 0.1}, 0.0021), 12);
}

TEST(ResidualIndex, small_worlds) {
  HeightGrid one(1, 1);
  one.at(0, 0) = 7;
  expect_all_hold(MadeUpSource(one, {10, 45}, 0.001), 3);
  expect_all_hold(MadeUpSource(HeightGrid(40, 30, 0.0F), {179.5, 89.5}, 0.01), 4);  // flat, polar
}

/// A mesh of the whole square with `n` random vertices, by inserting each into its triangle.
Tin random_mesh(unsigned seed, int n, double low, double high) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> place(1, 32766);
  std::uniform_real_distribution<double> height(low, high);
  Tin mesh;
  for (const auto& [x, y] : {std::pair(0, 0), {32767, 0}, {32767, 32767}, {0, 32767}})
    mesh.vertices.push_back({double(x), double(y), height(random)});
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  while (n-- > 0) {
    const Vec3 p{double(place(random)), double(place(random)), height(random)};
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto [a, b, c] = mesh.triangles[t];
      const auto& v = mesh.vertices;
      if (orient2d(v[a], v[b], p) <= 0 || orient2d(v[b], v[c], p) <= 0 ||
          orient2d(v[c], v[a], p) <= 0)
        continue;
      const auto k = std::uint32_t(mesh.vertices.size());
      mesh.vertices.push_back(p);
      mesh.triangles[t] = {a, b, k};
      mesh.triangles.push_back({b, c, k});
      mesh.triangles.push_back({c, a, k});
      break;
    }
  }
  return mesh;
}

double true_error(const Tin& mesh, const std::vector<Post>& posts) {
  double worst = 0;
  for (const Post& p : posts)
    for (const Triangle& t : mesh.triangles) {
      const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      const Vec3 at{p.u, p.v, 0};
      const double area = orient2d(a, b, c);
      const double wa = orient2d(b, c, at) / area, wb = orient2d(c, a, at) / area;
      if (wa < -1e-9 || wb < -1e-9 || wa + wb > 1 + 1e-9) continue;
      worst = std::max(worst, std::abs(wa * a.z + wb * b.z + (1 - wa - wb) * c.z - p.height));
    }
  return worst;
}

TEST(LatticeBound, is_never_below_the_true_error_of_any_mesh) {
  const TempDir dir;
  const MadeUpSource source(test::terrain_with_voids(620, 500, 5), {10.123, 45.9}, 0.00131);
  const auto index = index_of(source, dir, 9);
  ASSERT_TRUE(index);
  unsigned seed = 0;
  for (int z = 9; z >= 6; --z)
    for (const TileId id : tiles_over(source, z)) {
      const auto lattice = index->lattice(id);
      ASSERT_TRUE(lattice);
      const auto posts = posts_of(source, id);
      for (const int vertices : {0, 3, 40}) {
        const Tin mesh = random_mesh(++seed, vertices, 0, 500);
        const double error = true_error(mesh, posts), bound = lattice_bound(mesh, *lattice);
        EXPECT_GE(bound + 1e-9, error) << id.text();
      }
    }
}

/// |mesh - surface| and the cell's residual at places along the mesh's edges, its corners among
/// them: what the bound must not have passed over.
double worst_seen(const Tin& mesh, const ResidualLattice& lattice) {
  const double side = ResidualLattice::kExtent / lattice.cells;
  double worst = 0;
  const auto look = [&](double x, double y, double z) {
    const int col = std::clamp(int(x / side), 0, lattice.cells - 1);
    const int row = std::clamp(int((ResidualLattice::kExtent - y) / side), 0, lattice.cells - 1);
    const double residual = lattice.residual[std::size_t(row * lattice.cells + col)];
    if (residual < 0) return;
    worst = std::max(worst, std::abs(z - surface(lattice, col, row, x, y)) + residual);
  };
  for (const Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = mesh.vertices[t[k]], &b = mesh.vertices[t[(k + 1) % 3]];
      for (double share = 0; share <= 1; share += 1.0 / 1024)
        look(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.z + share * (b.z - a.z));
    }
  return worst;
}

TEST(LatticeBound, passes_over_nothing_that_is_worse) {
  const TempDir dir;
  const MadeUpSource source(test::terrain_with_voids(620, 500, 5), {10.123, 45.9}, 0.00131);
  const auto index = index_of(source, dir, 9);
  ASSERT_TRUE(index);
  unsigned seed = 100;
  for (const TileId id : tiles_over(source, 8)) {
    auto lattice = index->lattice(id);
    ASSERT_TRUE(lattice);
    // Residuals that differ from cell to cell by more than the meshes do.
    for (std::size_t c = 0; c < lattice->residual.size(); ++c)
      if (lattice->residual[c] >= 0) lattice->residual[c] += float(c * 7919 % 400);
    for (const int vertices : {0, 5, 60}) {
      const Tin mesh = random_mesh(++seed, vertices, 0, 500);
      const double bound = lattice_bound(mesh, *lattice);
      EXPECT_GE(bound + 1e-6, worst_seen(mesh, *lattice)) << id.text();
      EXPECT_TRUE(is_within(mesh, *lattice, bound));
      EXPECT_EQ(is_within(mesh, *lattice, bound * (1 - 1e-9)), bound == 0);
      const auto over = heights_of_cells_over(mesh, *lattice, bound * (1 - 1e-9));
      EXPECT_EQ(std::ranges::any_of(over, [](float h) { return !std::isnan(h); }), bound > 0);
    }
  }
}

TEST(LatticeBound, of_a_mesh_that_is_the_lattice_is_the_residual) {
  const TempDir dir;
  const MadeUpSource source(HeightGrid(300, 300, 12.0F), {0, 1}, 1.0 / 300);
  const auto index = index_of(source, dir, 7);
  ASSERT_TRUE(index);
  const auto lattice = index->lattice({7, 128, 64});
  ASSERT_TRUE(lattice);
  ASSERT_GT(lattice->posts, 0u);
  Tin flat;
  flat.vertices = {{0, 0, 12}, {32767, 0, 12}, {32767, 32767, 12}, {0, 32767, 12}};
  flat.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_NEAR(lattice_bound(flat, *lattice), 0, 1e-6);
  flat.vertices[2].z = 20;
  EXPECT_GT(lattice_bound(flat, *lattice), 5.6);  // posts end at 1 of 1.40625 degrees
}

std::vector<std::vector<std::uint8_t>> records(const MadeUpSource& source,
                                               const ResidualIndex& index, int deepest) {
  std::vector<std::vector<std::uint8_t>> all;
  for (int z = deepest; z >= 0; --z)
    for (const TileId id : tiles_over(source, z)) {
      const auto record = index.record(id);
      EXPECT_TRUE(record) << id.text();
      if (record) all.push_back(encode(**record));
    }
  return all;
}

TEST(ResidualIndex, is_the_same_for_any_number_of_threads_and_after_a_stop) {
  const MadeUpSource source(test::terrain_with_voids(300, 200, 6), {10.123, 45.9}, 0.00131);
  const TempDir one, four, stopped;
  const auto wanted = records(source, *index_of(source, one, 10, 1), 10);
  EXPECT_EQ(records(source, *index_of(source, four, 10, 4), 10), wanted);

  // The disk fails again and again, each time a little later, once in the middle of a record.
  int tries = 0;
  for (std::int64_t reads = 150;; reads += 150) {
    source.reads_left = reads;
    const auto index = ResidualIndex::open_or_make(stopped.file("index"), source, 10, 2);
    if (index) break;
    EXPECT_EQ(index.error().code, Errc::io);
    ASSERT_LT(++tries, 100);
    std::ofstream(stopped.file("index.part"), std::ios::app | std::ios::binary) << "half a record";
  }
  EXPECT_GT(tries, 2);
  source.reads_left = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(records(source, *index_of(source, stopped, 10), 10), wanted);
}

TEST(ResidualIndex, is_kept_and_made_anew_when_it_is_wrong) {
  const MadeUpSource source(test::terrain_with_voids(300, 200, 6), {10.123, 45.9}, 0.00131);
  const TempDir dir;
  const std::string path = dir.file("index");
  const auto wanted = records(source, *index_of(source, dir, 8), 8);
  EXPECT_FALSE(index_of(source, dir, 8)->made_now());
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  const auto size = std::filesystem::file_size(path);
  const auto flip = [&](std::uint64_t at) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(std::streamoff(at));
    const char byte = char(file.get() ^ 0x10);
    file.seekp(std::streamoff(at));
    file.put(byte);
  };
  std::mt19937_64 random(1);
  for (int k = 0; k < 200; ++k) {
    const std::uint64_t at = k < 72 ? std::uint64_t(k) : random() % size;  // every byte of the head
    flip(at);
    const auto damaged = ResidualIndex::open(path, source, 8);
    ASSERT_FALSE(damaged) << at;
    EXPECT_EQ(damaged.error().code, Errc::bad_data);
    flip(at);
  }
  for (const std::uint64_t at : {std::uint64_t(20), std::uint64_t(80), size / 2, size - 5}) {
    flip(at);
    const auto index = index_of(source, dir, 8);
    EXPECT_TRUE(index->made_now());
    EXPECT_EQ(records(source, *index, 8), wanted);
  }
  std::filesystem::resize_file(path, size - 1);
  EXPECT_EQ(ResidualIndex::open(path, source, 8).error().code, Errc::bad_data);
  EXPECT_TRUE(index_of(source, dir, 8)->made_now());
  EXPECT_EQ(ResidualIndex::open(path, source, 7).error().code, Errc::bad_data);  // other level
  EXPECT_EQ(ResidualIndex::open(dir.file("none"), source, 8).error().code, Errc::not_found);
  ASSERT_EQ(::mkfifo(dir.file("pipe").c_str(), 0600), 0);
  EXPECT_EQ(ResidualIndex::open(dir.file("pipe"), source, 8).error().code, Errc::bad_data);
}

/// Others may write there, too, and may know the number of this process.
TEST(ResidualIndex,
     where_nothing_is_kept_is_in_a_folder_of_its_own_in_the_one_for_temporary_files) {
  const MadeUpSource source(test::terrain_with_voids(300, 200, 6), {10.123, 45.9}, 0.00131);
  const TempDir temporary, other;
  const std::string victim = other.file("victim");
  std::ofstream(victim) << "mine";
  for (int n = 0; n < 20; ++n)
    for (const char* ending : {".residuals", ".residuals.part"})
      std::filesystem::create_symlink(
          victim, temporary.file(fmt::format("tind-{}-{}{}", ::getpid(), n, ending)));
  const char* const was = std::getenv("TMPDIR");
  const std::string before = was ? was : "";
  ::setenv("TMPDIR", temporary.path().c_str(), 1);
  const auto plan = plan_source(source, {.exact_posts = 2000}, "");
  if (was)
    ::setenv("TMPDIR", before.c_str(), 1);
  else
    ::unsetenv("TMPDIR");
  ASSERT_TRUE(plan) << plan.error().what;
  ASSERT_NE(plan->index(), nullptr);
  EXPECT_EQ(read_whole_file(victim).value_or(""), "mine");
  const std::filesystem::directory_iterator left(temporary.path());
  EXPECT_EQ(std::distance(begin(left), end(left)), 40) << "what was planted, and nothing else";

  const std::string path = other.file("index");  // nor a link where it is kept
  std::filesystem::create_symlink(victim, path + ".part");
  EXPECT_FALSE(ResidualIndex::open_or_make(path, source, 8, 1));
  EXPECT_EQ(read_whole_file(victim).value_or(""), "mine");
}

TEST(ResidualIndex, is_not_waited_for_longer_than_it_takes) {
  const MadeUpSource source(test::terrain_with_voids(300, 200, 6), {10.123, 45.9}, 0.00131);
  const TempDir dir;
  std::array<Result<std::shared_ptr<const ResidualIndex>>, 4> found = {
      fail(Errc::internal, ""), fail(Errc::internal, ""), fail(Errc::internal, ""),
      fail(Errc::internal, "")};
  std::stop_source stop;
  {
    std::vector<std::jthread> threads;
    for (auto& one : found)
      threads.emplace_back([&] {
        one = ResidualIndex::open_or_make(dir.file("index"), source, 9, 1,
                                          Progress{{}, stop.get_token()});
      });
    // Each holds what it has: whoever waits for its end waits for ever.
    std::jthread watch([&](std::stop_token done) {
      for (int k = 0; k < 6000 && !done.stop_requested(); ++k)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      stop.request_stop();
    });
    threads.clear();
  }
  for (const auto& one : found) EXPECT_TRUE(one) << one.error().what;
  EXPECT_EQ(std::ranges::count_if(found, [](const auto& one) { return (*one)->made_now(); }), 1);
}

TEST(ResidualIndex, says_where_a_height_is_beyond_it) {
  HeightGrid grid = test::rough_terrain(260, 260, 8);
  grid.at(100, 100) = 20e3f;
  const double spacing = tiling::tile_degrees(9) / 256;
  const Geographic corner{tiling::rect({9, 550, 380}).west, tiling::rect({9, 550, 380}).north};
  const auto r = scan_residuals(MadeUpSource(grid, corner, spacing), {9, 550, 380}, 1. / 1024);
  ASSERT_FALSE(r);
  EXPECT_EQ(r.error().code, Errc::unsupported);
  EXPECT_NE(r.error().what.find("beyond what the residual index"), std::string::npos);
}

/// What tiles of layers are held to: the posts that decide, and then samples at rims.
std::vector<Post> posts_of(const HeightField& field, TileId id, std::uint64_t& posts) {
  const GeoRect rect = tiling::rect(id);
  std::vector<Post> all;
  for (std::size_t k = 0; k < field.surface().layers().size(); ++k) {
    const DemSource& source = *field.surface().layers()[k].source;
    std::vector<Geographic> places;
    for (int r = 0; r < source.info().rows; ++r)
      for (int c = 0; c < source.info().cols; ++c) {
        const Vec2 p = source.info().post_to_crs.apply(c, r);
        if (p.x >= rect.west && p.x <= rect.east && p.y >= rect.south && p.y <= rect.north)
          places.push_back({p.x, p.y});
      }
    std::vector<double> heights(places.size());
    std::vector<int> deciding(places.size());
    field.at(places, heights, deciding);
    for (std::size_t i = 0; i < places.size(); ++i)
      if (deciding[i] == int(k))
        all.push_back({(places[i].lon - rect.west) / rect.width() * 32767,
                       (places[i].lat - rect.south) / rect.height() * 32767, heights[i]});
  }
  posts = all.size();
  const auto rims = rim_samples(field, id);
  EXPECT_TRUE(rims);
  for (const Vec3& p : *rims) all.push_back({p.x, p.y, p.z});
  return all;
}

TEST(ResidualIndex, of_layers_bounds_every_post_that_decides_and_every_rim) {
  const TempDir dir;
  const Surface surface = test::three_ranks();
  const auto depth = IndexDepth::of(surface, 1 << 12);
  const auto index = ResidualIndex::open_or_make(dir.file("index"), surface, depth, 2);
  ASSERT_TRUE(index) << index.error().what;
  const HeightField field(surface);
  std::size_t rims = 0;
  for (const TileId id : depth.tiles()) {
    if (!(*index)->serves(id)) continue;
    SCOPED_TRACE(id.text());
    std::uint64_t posts = 0;
    const std::vector<Post> all = posts_of(field, id, posts);
    const auto lattice = (*index)->lattice(id);
    ASSERT_TRUE(lattice) << lattice.error().what;
    EXPECT_EQ(lattice->posts, posts);
    EXPECT_EQ(lattice->any(), !all.empty());
    rims += all.size() - posts;
    ResidualLattice rounded = *lattice;  // posts that are bent are kept as floats
    for (float& bound : rounded.residual)
      if (bound >= 0) bound += 1e-3F;
    expect_bounds_hold(all, rounded);
    for (const Post& p : all) {
      EXPECT_GE(p.height, lattice->min_m - 1e-3);
      EXPECT_LE(p.height, lattice->max_m + 1e-3);
    }
    if (HasFailure()) return;
  }
  EXPECT_GT(rims, 1000u);
}

TEST(ResidualIndex, of_layers_is_deep_where_fine_posts_are_and_not_elsewhere) {
  const Surface surface = test::three_ranks();
  EXPECT_EQ(IndexDepth::of(surface).level(), -1);  // few posts
  const auto depth = IndexDepth::of(surface, 1 << 12);
  ASSERT_GT(depth.level(), 0);
  EXPECT_LT(depth.coarsest_level(), depth.level());
  EXPECT_EQ(deepest_indexed_level(surface, 1 << 12), depth.level() - 1);
  const std::size_t town = 3;
  std::size_t deep = 0;
  for (const TileId id : depth.tiles()) {
    EXPECT_TRUE(id.level == 0 || depth.serves(id.parent())) << id.text();
    if (id.level < depth.level() - 1) continue;
    ++deep;
    EXPECT_TRUE(surface.reaches(town, tiling::rect(id))) << id.text();
  }
  EXPECT_GT(deep, 0u);
  EXPECT_LT(deep, 20u);
  // Another layer changes nothing where it does not reach.
  std::vector<SurfaceLayer> layers(surface.layers().begin(), surface.layers().end());
  layers.push_back({"far", test::made(test::rough_terrain(90, 90, 7), {10.9, 49.2}, 0.0005)});
  const Surface more = *Surface::of_layers(layers);
  const auto other = IndexDepth::of(more, 1 << 12);
  for (const TileId id : other.tiles())
    if (!more.reaches(4, tiling::rect(id))) {
      EXPECT_TRUE(depth.serves(id)) << id.text();
    }
  EXPECT_EQ(other.step_m(), depth.step_m());
}

TEST(ResidualIndex, has_steps_in_which_records_hold_the_heights_of_the_earth) {
  for (int level = 0; level <= 24; ++level) EXPECT_LT(9000 / IndexDepth(level).step_m(), 1 << 24);
}

TEST(ResidualIndex, of_layers_goes_on_after_a_stop_and_is_made_anew_of_other_layers_or_depth) {
  const auto base = std::make_shared<const MadeUpSource>(test::rough_terrain(60, 50, 1, 2000),
                                                         Geographic{10, 50}, 0.02);
  const auto fine = test::made(test::terrain_with_voids(90, 90, 2), {10.3, 49.7}, 0.004, 0.1);
  const Surface surface = *Surface::of_layers({{"base", base}, {"fine", fine}});
  const auto depth = IndexDepth::of(surface, 1 << 12);
  const auto encoded = [&](const ResidualIndex& index) {
    std::vector<std::vector<std::uint8_t>> all;
    for (const TileId id : depth.tiles())
      for (int part = 0; part < 4; ++part)
        if (const auto record = index.record(id.child(part % 2, part / 2)))
          all.push_back(encode(**record));
    return all;
  };
  const TempDir one, stopped;
  const auto whole = ResidualIndex::open_or_make(one.file("index"), surface, depth, 1);
  ASSERT_TRUE(whole);
  int tries = 0;
  for (std::int64_t reads = 100;; reads *= 3) {
    base->reads_left = reads;
    const auto index = ResidualIndex::open_or_make(stopped.file("index"), surface, depth, 3);
    if (index) {
      EXPECT_EQ(encoded(**index), encoded(**whole));
      break;
    }
    EXPECT_EQ(index.error().code, Errc::io);
    ASSERT_LT(++tries, 30);
  }
  EXPECT_GT(tries, 1);
  base->reads_left = std::numeric_limits<std::int64_t>::max();
  const std::string path = one.file("index");
  EXPECT_TRUE(ResidualIndex::open(path, surface, depth));
  EXPECT_EQ(ResidualIndex::open(path, surface, IndexDepth::of(surface, 2000)).error().code,
            Errc::bad_data);
  const Surface blended =
      *Surface::of_layers({{"base", base}, {.name = "fine", .source = fine, .blend_m = 900}});
  const Surface turned = *Surface::of_layers({{"fine", fine}, {"base", base}});
  for (const Surface& other : {blended, turned})
    EXPECT_EQ(ResidualIndex::open(path, other, depth).error().code, Errc::bad_data);
}

TEST(ResidualRecord, begins_with_what_its_tile_is_and_its_sides) {
  HeightGrid grid = test::rough_terrain(260, 260, 8);
  const double spacing = tiling::tile_degrees(9) / 256;
  const Geographic corner{tiling::rect({9, 550, 380}).west, tiling::rect({9, 550, 380}).north};
  const auto r = scan_residuals(MadeUpSource(grid, corner, spacing), {9, 550, 380}, 0.125);
  ASSERT_TRUE(r);
  std::vector<std::uint8_t> bytes = encode(*r);
  const auto head = decode_head(std::span(bytes).first(kMostHeadBytes));
  ASSERT_TRUE(head) << head.error().what;
  EXPECT_TRUE(head->has_heights);
  EXPECT_EQ(head->posts(), r->posts());
  EXPECT_EQ(std::pair(head->min_m, head->max_m), std::pair(r->min_m, r->max_m));
  for (int k = 0; k < ResidualRecord::kNodes; ++k) {
    const auto i = std::size_t(k);
    EXPECT_EQ(head->north[i], r->height(k, 0));
    EXPECT_EQ(head->south[i], r->height(k, ResidualRecord::kCells));
    EXPECT_EQ(head->west[i], r->height(0, k));
    EXPECT_EQ(head->east[i], r->height(ResidualRecord::kCells, k));
  }
  const auto whole = decode_record(bytes);
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->heights, r->heights);
  for (const std::size_t at : {std::size_t(3), std::size_t(60), std::size_t(700)}) {
    bytes[at] ^= 1;
    EXPECT_FALSE(decode_head(std::span(bytes).first(kMostHeadBytes))) << at;
    EXPECT_FALSE(decode_record(bytes)) << at;
    bytes[at] ^= 1;
  }
  EXPECT_FALSE(decode_head(std::span(bytes).first(500)));
  EXPECT_FALSE(decode_record(std::span(bytes).first(bytes.size() - 1)));
}

/// Steps of every width side by side, up to the farthest heights that there may be.
TEST(ResidualRecord, keeps_heights_however_far_apart) {
  ResidualRecord r;
  std::mt19937 random(5);
  r.heights.resize(std::size_t(ResidualRecord::kNodes) * ResidualRecord::kNodes);
  for (std::int32_t& h : r.heights) {
    const int bits = int(random() % 25);
    h = int(random() % ((1u << bits) + 1)) * (random() % 2 ? 1 : -1);
  }
  const auto again = decode_record(encode(r));
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->heights, r.heights);
  EXPECT_FALSE(again->has_posts());
  r.heights[1000] = (1 << 24) + 1;
  EXPECT_FALSE(decode_record(encode(r)));
}

TEST(ResidualIndex, is_for_tiles_of_many_posts_of_large_sources_only) {
  DemInfo info;
  info.crs_kind = CrsKind::geographic;
  info.bounds = {0, -1, 2, 1};
  info.spacing_x_m = info.spacing_y_m = 111320.0 / 3600;
  info.cols = info.rows = 5000;
  EXPECT_EQ(deepest_indexed_level(info), -1);
  info.cols = info.rows = 100'000;
  const int level = deepest_indexed_level(info);
  const double posts = tiling::tile_degrees(level) * 3600;
  EXPECT_GT(posts * posts * 1.02, double(kExactTilePosts));
  EXPECT_LT(posts * posts / 4, double(kExactTilePosts));  // of the next level
  EXPECT_EQ(deepest_indexed_level(info, std::int64_t(100'000) * 100'000), -1);
}

}  // namespace
}  // namespace tind
