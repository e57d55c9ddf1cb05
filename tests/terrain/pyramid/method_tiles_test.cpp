// Tiles by every method that makes them: the same promises as bounded's, on every kind of source.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>

#include "proto/tile/quantized_mesh.h"
#include "terrain/check/check.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/make/tile_methods.h"
#include "terrain/pyramid/plan/tile_method.h"
#include "terrain/pyramid/plan/tile_version.h"
#include "terrain/simplify/method_text.h"
#include "terrain/simplify/methods.h"
#include "tests/support/made_up_source.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using test::MadeUpSource;
using test::TempDir;

/// All that make tiles, and the variants that place vertices otherwise.
std::vector<MethodOptions> tile_methods() {
  std::vector<MethodOptions> all;
  for (const MethodOptions& method : all_methods())
    if (check_tile_method(method)) all.push_back(method);
  for (const char* text :
       {"qem subset-placement=on", "edge-cost term=height", "triangle-collapse placement=centroid",
        "vertex-removal criterion=degree", "attribute-qem attribute-metric=separate"})
    all.push_back(*method_from_text(text));
  return all;
}

std::map<std::string, std::string> tiles_in(const std::string& directory) {
  std::map<std::string, std::string> tiles;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) {
    if (entry.path().extension() != ".terrain") continue;
    std::ifstream in(entry.path(), std::ios::binary);
    tiles[fs::relative(entry.path(), directory).string()] = {std::istreambuf_iterator<char>(in),
                                                             std::istreambuf_iterator<char>()};
  }
  return tiles;
}

/// Of each side: place along it, height as a client decodes it, normal.
using Borders = std::set<std::tuple<int, int, double, int, int>>;
Borders borders_of(const std::string& bytes) {
  const auto q = proto::decode({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  if (!q) throw std::runtime_error(q.error().what);
  Borders all;
  for (const auto* side : {&q->west, &q->south, &q->east, &q->north})
    for (const std::uint32_t i : *side)
      all.insert({q->u[i], q->v[i],
                  q->min_height + q->h[i] * ((double(q->max_height) - q->min_height) / 32767),
                  q->oct_normals[i][0], q->oct_normals[i][1]});
  return all;
}

struct Built {
  BuildReport report;
  std::map<std::string, std::string> tiles;
};

Built build(const Surface& surface, TileSetOptions tiles, const MethodOptions& method, int threads,
            bool check) {
  const TempDir folder;
  BuildOptions o;
  o.tiles = std::move(tiles);
  o.tiles.method = method;
  o.output = folder.file("tiles");
  o.threads = threads;
  const auto report = build_tiles(surface, o);
  EXPECT_TRUE(report) << report.error().what;
  if (!report) return {};
  if (check) {
    CheckOptions by;
    by.source = surface;
    const auto checked = check_tiles(o.output, by);
    EXPECT_TRUE(checked && checked->findings.total(Severity::violation) == 0)
        << method_text(method);
  }
  return {*report, tiles_in(o.output)};
}

void expect_tiles_by(const std::vector<MethodOptions>& methods, const Surface& surface,
                     const TileSetOptions& options) {
  const Built bounded = build(surface, options, BoundedOptions{}, 2, true);
  ASSERT_GT(bounded.tiles.size(), 10u);
  for (const MethodOptions& method : methods) {
    const std::string name = method_text(method);
    const Built one = build(surface, options, method, 1, true);
    EXPECT_TRUE(one.tiles == build(surface, options, method, 4, false).tiles) << name;
    EXPECT_EQ(one.report.over_budget, bounded.report.over_budget) << name;
    EXPECT_LE(one.report.by_bounded, one.report.tiles / 4) << name;
    ASSERT_EQ(one.tiles.size(), bounded.tiles.size()) << name;
    int others = 0;
    for (const auto& [tile, bytes] : one.tiles) {
      const std::string& by_bounded = bounded.tiles.at(tile);
      EXPECT_EQ(borders_of(bytes), borders_of(by_bounded)) << name << " " << tile;
      others += bytes != by_bounded;
    }
    EXPECT_EQ(others > 0, !std::holds_alternative<BoundedOptions>(method)) << name;
  }
}

void expect_tiles_by_every_method(const Surface& surface, const TileSetOptions& options) {
  expect_tiles_by(tile_methods(), surface, options);
}

TEST(MethodTiles, of_a_grid_with_voids) {
  expect_tiles_by_every_method(std::make_shared<MadeUpSource>(test::terrain_with_voids(50, 40, 3),
                                                              Geographic{7.1, 45.9}, .002),
                               {.max_error_m = 15});
}

TEST(MethodTiles, of_posts_on_no_line_of_longitude) {
  expect_tiles_by_every_method(std::make_shared<MadeUpSource>(test::terrain_with_voids(44, 36, 4),
                                                              Geographic{7.1, 45.9}, .002, 0.3),
                               {.max_error_m = 15});
}

/// One of each family: what the tests of every method need not try again.
std::vector<MethodOptions> some_methods() {
  return {GreedyOptions{}, EdgeCostOptions{}, VertexRemovalOptions{}};
}

TEST(MethodTiles, on_one_side) {
  for (const Side side : {Side::above, Side::below})
    expect_tiles_by(some_methods(),
                    std::make_shared<MadeUpSource>(test::rough_terrain(26, 22, 5, 300),
                                                   Geographic{7.1, 45.9}, .002),
                    {.max_error_m = 20, .side = side});
}

TEST(MethodTiles, through_the_residual_index) {
  expect_tiles_by(some_methods(),
                  std::make_shared<MadeUpSource>(test::rough_terrain(300, 230, 6, 100),
                                                 Geographic{7.1, 45.9}, .001),
                  {.max_error_m = 90, .exact_posts = 1 << 16});
}

TEST(MethodTiles, that_stand_in_for_a_child_that_is_missing) {
  const TempDir folder;
  const double side = tiling::tile_degrees(9);
  const double lon = -180 + 543 * side, lat = -90 + 401 * side;
  std::vector<std::string> files;
  for (const auto& [west, south] :
       {std::pair{lon - .145, lat - .145}, {lon + .045, lat - .145}, {lon - .145, lat + .045}}) {
    const std::string path = folder.file(std::to_string(files.size()) + ".asc");
    std::ofstream(folder.file(std::to_string(files.size()) + ".prj"))
        << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
           R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
    std::ofstream out(path);
    out.precision(17);
    out << "ncols 21\nnrows 21\nxllcenter " << west << "\nyllcenter " << south
        << "\ncellsize 0.005\nNODATA_value -9999\n";
    for (int k = 0; k < 21 * 21; ++k) out << 900 + k * 37 % 101 << (k % 21 == 20 ? '\n' : ' ');
    files.push_back(path);
  }
  const auto source = DemSource::open(files);
  ASSERT_TRUE(source) << source.error().what;
  expect_tiles_by_every_method(*source, {.max_error_m = 10});
}

TEST(MethodTiles, of_cliffs_that_no_grid_can_follow_are_never_worse_than_boundeds) {
  HeightGrid cliffs(40, 40);
  for (int r = 0; r < 40; ++r)
    for (int c = 0; c < 40; ++c) cliffs.at(c, r) = (c * 7 + r * 3) % 5 < 2 ? 8000.f : -8000.f;
  const Surface surface = std::make_shared<MadeUpSource>(cliffs, Geographic{7.1, 45.9}, 1e-6);
  const TileSetOptions options{.max_error_m = .01, .max_level = 15};
  const Built bounded = build(surface, options, BoundedOptions{}, 2, false);
  ASSERT_GT(bounded.report.over_budget, 0u);
  std::uint64_t by_bounded = 0;
  for (const MethodOptions& method : tile_methods()) {
    const Built one = build(surface, options, method, 2, false);
    ASSERT_EQ(one.report.levels.size(), bounded.report.levels.size());
    for (std::size_t z = 0; z < one.report.levels.size(); ++z)
      EXPECT_LE(one.report.levels[z].worst_error_m,
                std::max(bounded.report.levels[z].worst_error_m, bounded.report.levels[z].budget_m))
          << method_text(method) << " " << z;
    by_bounded += one.report.by_bounded;
  }
  EXPECT_GT(by_bounded, 0u);
}

TEST(MethodTiles, that_cannot_be_made_say_who_can) {
  const auto cluster = check_tile_method(ClusterOptions{});
  ASSERT_FALSE(cluster);
  for (const MethodInfo& m : methods())
    EXPECT_EQ(m.tiles, cluster.error().what.find(m.name + ",") != std::string::npos ||
                           cluster.error().what.ends_with(m.name))
        << m.name;
  EXPECT_FALSE(check_tile_method(*method_from_text("attribute-qem attributes=texture")));
  EXPECT_FALSE(check_tile_method(EdgeCostOptions{.alpha = -1}));
  EXPECT_FALSE(check_tile_method(VertexRemovalOptions{.k = 0}));
  const MadeUpSource source(test::rough_terrain(9, 9, 1), {7, 45}, .01);
  EXPECT_EQ(TilePlan::make(source, HeightRange{}, {.method = ClusterOptions{}}).error().code,
            Errc::invalid_argument);
}

TEST(MethodTiles, of_two_methods_never_mix) {
  const TempDir folder;
  const Surface surface =
      std::make_shared<MadeUpSource>(test::rough_terrain(30, 30, 1), Geographic{7.1, 45.9}, .002);
  BuildOptions o;
  o.output = folder.file("tiles");
  o.tiles.method = QemOptions{};
  ASSERT_TRUE(build_tiles(surface, o));
  const auto again = build_tiles(surface, o);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->built, 0u);
  o.tiles.method = QemOptions{.subset_placement = true};
  EXPECT_FALSE(build_tiles(surface, o));
  o.tiles.method = BoundedOptions{};
  EXPECT_FALSE(build_tiles(surface, o));
  o.force = true;
  EXPECT_TRUE(build_tiles(surface, o));
  const auto version = [&](const MethodOptions& method) {
    return tile_version(surface, *TilePlan::make(surface, HeightRange{}, {.method = method}), "");
  };
  std::set<std::string> versions;
  for (const MethodOptions& method : tile_methods()) versions.insert(version(method));
  EXPECT_EQ(versions.size(), tile_methods().size());
}

// --- one mesh in its frame ---

constexpr double kEnd = 32767;

/// A frame with uneven borders and one line across, of two edges.
HalfedgeMesh frame_with_line(LinePoints& kept) {
  Tin corners;
  corners.vertices = {{0, 0, 0}, {kEnd, 0, 8}, {kEnd, kEnd, -8}, {0, kEnd, 16}};
  corners.triangles = {{0, 1, 2}, {0, 2, 3}};
  HalfedgeMesh mesh = *HalfedgeMesh::from_tin(corners);
  const GridSamples none;
  DelaunayInsertion<GridSamples> insertion(mesh, none, {});
  for (const Vec3& p : {Vec3{9000, 0, 4},
                        {kEnd, 20000, 4},
                        {16384, kEnd, 0},
                        {16384, 8000, 12},
                        {16384, 16000, 4},
                        {16384, 24000, 12}})
    insertion.insert_point(p);
  insertion.keep(&kept);
  for (const auto& [a, b] : {std::pair{7u, 8u}, {8u, 9u}}) {
    EXPECT_NE(mesh.find_edge(a, b), HalfedgeMesh::kNone);
    kept.add_edge(a, b);
  }
  return mesh;
}

TEST(MethodTiles, leave_the_frame_and_its_lines_alone) {
  constexpr int kPosts = 41;
  HeightGrid grid = test::rough_terrain(kPosts, kPosts, 9, 60);
  for (int r = 0; r < kPosts; ++r)  // the border is the frame's business, and so is the line
    for (int c = 0; c < kPosts; ++c)
      if (r % (kPosts - 1) == 0 || c % (kPosts - 1) == 0 || c == kPosts / 2)
        grid.at(c, r) = HeightGrid::kVoid;
  GridSamples samples;
  samples.cols = samples.rows = kPosts;
  samples.y0 = kEnd, samples.dx = samples.dy = kEnd / (kPosts - 1);
  samples.z = grid.values().data();
  MesherOptions o;
  o.eps = 6, o.relief = 60, o.x_scale = 0.7;
  o.locked_border = o.integer_lattice = true, o.lattice_max = kEnd;
  o.lattice_step = 4, o.height_step = 0.5, o.height_min = -1000, o.height_max = 1000;
  for (const MethodOptions& method : tile_methods()) {
    if (std::holds_alternative<BoundedOptions>(method)) continue;
    const std::string name = method_text(method);
    LinePoints kept;
    HalfedgeMesh frame = frame_with_line(kept);
    o.pinned = std::uint32_t(frame.vertex_slots());
    const Tin before = frame.to_tin();
    const Tin made = mesh_by_method(method, frame, &kept, samples, o, 1, {});
    std::map<std::pair<double, double>, std::size_t> at;
    for (std::size_t v = 0; v < made.vertices.size(); ++v) {
      const Vec3& p = made.vertices[v];
      EXPECT_EQ(p.x, std::nearbyint(p.x)) << name;
      EXPECT_EQ(p.y, std::nearbyint(p.y)) << name;
      EXPECT_EQ(p.z, snap_height(p.z, o.height_step)) << name;
      at[{p.x, p.y}] = v;
    }
    EXPECT_EQ(at.size(), made.vertices.size()) << name;
    for (const Vec3& p : before.vertices) {
      ASSERT_TRUE(at.contains({p.x, p.y})) << name;
      EXPECT_EQ(made.vertices[at.at(std::pair(p.x, p.y))].z, p.z) << name;
    }
    std::size_t on_border = 0;
    for (const Vec3& p : made.vertices)
      on_border += p.x == 0 || p.y == 0 || p.x == kEnd || p.y == kEnd;
    EXPECT_EQ(on_border, 7u) << name;
    const HalfedgeMesh mesh = *HalfedgeMesh::from_tin(made);
    for (const auto& [from, to] : {std::pair{8000., 16000.}, {16000., 24000.}})
      EXPECT_NE(mesh.find_edge(std::uint32_t(at[{16384, from}]), std::uint32_t(at[{16384, to}])),
                HalfedgeMesh::kNone)
          << name;
    double area = 0, worst = 0;
    for (const Triangle& t : made.triangles) {
      const Vec3 &a = made.vertices[t[0]], &b = made.vertices[t[1]], &c = made.vertices[t[2]];
      ASSERT_GT(orient2d(a, b, c), 0) << name;
      area += orient2d(a, b, c);
      const TrianglePlane plane(a, b, c);
      samples.scan(a, b, c, [&](double x, double y, double z, std::size_t) {
        worst = std::max(worst, std::abs(plane.at(x, y) - z));
        return true;
      });
    }
    EXPECT_EQ(area, 2 * kEnd * kEnd) << name;
    EXPECT_LE(worst, o.eps) << name;
    EXPECT_LT(made.triangles.size(), 0.8 * 2 * (kPosts - 1) * (kPosts - 1)) << name;
  }
}

}  // namespace
}  // namespace tind
