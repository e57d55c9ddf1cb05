// One planted defect per rule: a good pyramid, one thing made wrong in it, and `check` must call it
// by its name.

#include "terrain/check/check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "proto/tile/quantized_mesh.h"
#include "terrain/check/check_decode.h"
#include "terrain/check/check_tile.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/tile/culling.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;
using Json = nlohmann::ordered_json;
using Mesh = proto::QuantizedMesh;

std::shared_ptr<const DemSource> open(const std::string& path) {
  const std::string files[] = {path};
  auto source = DemSource::open(files);
  EXPECT_TRUE(source.has_value()) << source.error().what;
  return source ? *source : nullptr;
}

/// A directory of tiles that can be made wrong.
class Tiles {
 public:
  explicit Tiles(fs::path folder) : folder_(std::move(folder)) {}

  fs::path path(const std::string& tile) const { return folder_ / (tile + ".terrain"); }
  const fs::path& folder() const { return folder_; }

  Bytes read(const fs::path& path) const {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  void write(const fs::path& path, std::span<const std::uint8_t> bytes) const {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  }
  template <class F>
  void bytes(const std::string& tile, F&& change) const {
    Bytes b = read(path(tile));
    change(b);
    write(path(tile), b);
  }
  Mesh mesh(const std::string& tile) const { return proto::decode(read(path(tile))).value(); }
  template <class F>
  void edit(const std::string& tile, F&& change) const {
    Mesh m = mesh(tile);
    change(m);
    write(path(tile), proto::encode(m));
  }
  template <class F>
  void metadata(const std::string& tile, F&& change) const {
    edit(tile, [&](Mesh& m) {
      Json json = Json::parse(m.metadata);
      change(json);
      m.metadata = json.dump();
    });
  }
  template <class F>
  void layer(F&& change) const {
    Json json = Json::parse(read(folder_ / "layer.json"));
    change(json);
    const std::string text = json.dump();
    write(folder_ / "layer.json",
          {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  }

 private:
  fs::path folder_;
};

constexpr const char* kTile = "12/1463/2813";
constexpr const char* kSibling = "12/1462/2813";
constexpr const char* kParent = "11/731/1406";

std::size_t vertex_at(const Mesh& m, int u, int v) {
  for (std::size_t i = 0; i < m.u.size(); ++i)
    if (m.u[i] == u && m.v[i] == v) return i;
  return m.u.size();
}

/// Where the body's first triangle code is.
std::size_t first_code(const Bytes& b) { return 92 + 6 * (b[88] + 256u * b[89]) + 4; }

std::size_t index_of(std::string_view id) {
  for (std::size_t r = 0; r < kCheckRuleCount; ++r)
    if (kCheckRules[r].id == id) return r;
  ADD_FAILURE() << "no rule " << id;
  return 0;
}

Mesh square() {
  Mesh m;
  m.u = {0, 32767, 0, 32767};
  m.v = {0, 0, 32767, 32767};
  m.h = {0, 0, 0, 0};
  m.triangles = {{0, 1, 2}, {2, 1, 3}};
  proto::arrange(m);
  return m;
}

/// A grid with an odd number of vertices that needs 32-bit indices.
Mesh large() {
  Mesh m = square();
  m.u.clear(), m.v.clear(), m.triangles.clear();
  for (std::uint32_t y = 0; y < 257; ++y)
    for (std::uint32_t x = 0; x < 257; ++x) {
      m.u.push_back(std::uint16_t(x * 32767 / 256));
      m.v.push_back(std::uint16_t(y * 32767 / 256));
    }
  m.h.assign(m.u.size(), 0);
  for (std::uint32_t y = 0; y < 256; ++y)
    for (std::uint32_t x = 0; x < 256; ++x) {
      const std::uint32_t i = y * 257 + x;
      m.triangles.push_back({i, i + 1, i + 258});
      m.triangles.push_back({i, i + 258, i + 257});
    }
  proto::arrange(m);
  return m;
}

/// Four vertices with 32-bit indices, which is against the rule.
Bytes wide_indices() {
  Bytes b = proto::encode(square());
  const Bytes head(b.begin(), b.begin() + 92 + 24);
  Bytes wide = head;
  const auto put = [&](std::initializer_list<std::uint32_t> values) {
    for (const std::uint32_t value : values)
      for (int shift = 0; shift < 32; shift += 8) wide.push_back(std::uint8_t(value >> shift));
  };
  put({2, 0, 0, 0, 1, 2, 0});
  put({2, 0, 2, 2, 1, 0, 2, 3, 1, 2, 2, 3});
  return wide;
}

void add_extension(Bytes& b, std::uint8_t id, Bytes body, bool big_endian = false) {
  Bytes size = {std::uint8_t(body.size()), 0, 0, 0};
  if (big_endian) std::ranges::reverse(size);
  b.push_back(id);
  b.insert(b.end(), size.begin(), size.end());
  b.insert(b.end(), body.begin(), body.end());
}

/// Lowers a tile below the sea and gives it the occlusion point of a shore at 10 m.
void sink(Mesh& m, const GeoRect& rect) {
  m.min_height = -3000;
  m.max_height = -2900;
  std::vector<Vec3> shore;
  for (std::size_t i = 0; i < m.u.size(); ++i)
    shore.push_back({rect.west + rect.width() * m.u[i] / 32767,
                     rect.south + rect.height() * m.v[i] / 32767, 10});
  const Vec3 p = culling_volumes(rect, shore).horizon_occlusion;
  m.horizon_occlusion = {p.x, p.y, p.z};
}

using Defect = std::function<void(const Tiles&)>;

std::map<std::string, Defect> layer_defects() {
  const auto set = [](const char* key, Json value) {
    return [=](const Tiles& t) { t.layer([&](Json& j) { j[key] = value; }); };
  };
  const auto without = [](const char* key) {
    return [=](const Tiles& t) { t.layer([&](Json& j) { j.erase(key); }); };
  };
  return {
      {"layer.readable", [](const Tiles& t) { fs::remove(t.folder() / "layer.json"); }},
      {"layer.format", set("format", "heightmap-1.0")},
      {"layer.tiles", set("tiles", Json::array({"{z}/{x}.terrain"}))},
      {"layer.version", without("version")},
      {"layer.projection", set("projection", "EPSG:3857")},
      {"layer.scheme", set("scheme", "slippyMap")},
      {"layer.bounds", set("bounds", {-115, 33, -116, 34})},
      {"layer.available", without("available")},
      {"layer.range",
       [](const Tiles& t) { t.layer([](Json& j) { j["available"][1][0]["endX"] = 4; }); }},
      {"layer.roots",
       [](const Tiles& t) { t.layer([](Json& j) { j["available"][0][0]["endX"] = 0; }); }},
      {"layer.maxzoom", set("maxzoom", 13)},
      {"layer.minzoom", set("minzoom", -1)},
      {"layer.extensions", set("extensions", Json::array())},
      {"layer.attribution", without("attribution")},
      {"available.missing", [](const Tiles& t) { fs::remove(t.path(kTile)); }},
      {"available.unlisted",
       [](const Tiles& t) {
         fs::create_directories(t.path("12/9/9").parent_path());
         fs::copy(t.path(kTile), t.path("12/9/9"));
       }},
      {"available.orphan", [](const Tiles& t) { fs::remove(t.path(kParent)); }},
      {"build.blocks",
       [](const Tiles& t) {
         for (const auto& entry : fs::directory_iterator(t.folder()))
           if (entry.path().filename().string().starts_with("tind-blocks-"))
             t.write(entry.path(), Bytes(40, 0));
       }},
      {"available.stray", [](const Tiles& t) { fs::copy(t.path(kTile), t.path("copy of 12")); }},
  };
}

std::map<std::string, Defect> byte_defects() {
  const auto bytes = [](auto change) { return [=](const Tiles& t) { t.bytes(kTile, change); }; };
  const auto tile = [](Bytes b) { return [=](const Tiles& t) { t.write(t.path(kTile), b); }; };
  Bytes unpadded = proto::encode(large());
  unpadded.erase(unpadded.begin() + 92 + 6 * 66049, unpadded.begin() + 94 + 6 * 66049);
  Mesh empty = square();
  empty.triangles.clear();
  return {
      {"tile.readable",
       [](const Tiles& t) {
         fs::remove(t.path(kTile));
         fs::create_directory(t.path(kTile));
       }},
      {"tile.unread",
       [](const Tiles& t) {
         fs::remove(t.path(kTile));
         fs::create_symlink(t.path(kTile), t.path(kTile));  // a loop, which nobody can open
       }},
      {"tile.gzip", tile({0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3, 1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0, 0})},
      {"tile.ledger", bytes([](Bytes& b) { b[b.size() - 1] ^= 1; })},
      {"tile.truncated", bytes([](Bytes& b) { b.resize(b.size() / 2); })},
      {"tile.trailing", bytes([](Bytes& b) { b.insert(b.end(), 3, 0); })},
      {"tile.padding", tile(unpadded)},
      {"tile.index-width", tile(wide_indices())},
      {"tile.empty", tile(proto::encode(empty))},
      {"tile.header", bytes([](Bytes& b) { b[6] = 0xf0, b[7] = 0x7f; })},
      {"tile.quantised", bytes([](Bytes& b) { b[92] |= 1, b[93] = 0xff; })},
      {"tile.index", bytes([](Bytes& b) { b[first_code(b)] = 7; })},
      {"ext.big-endian", bytes([](Bytes& b) { add_extension(b, 2, {1}, true); })},
      {"ext.unknown", bytes([](Bytes& b) {
         add_extension(b, 77, {1, 2, 3});
       })},
      {"ext.duplicate",
       bytes([](Bytes& b) { add_extension(b, 2, {1}), add_extension(b, 2, {1}); })},
      {"ext.normals", bytes([](Bytes& b) {
         add_extension(b, 1, {1, 2, 3});
       })},
      {"ext.water-mask", bytes([](Bytes& b) {
         add_extension(b, 2, {1, 2, 3});
       })},
      {"ext.metadata", bytes([](Bytes& b) {
         add_extension(b, 4, {9, 0, 0, 0, '{', '}'});
       })},
  };
}

std::map<std::string, Defect> mesh_defects() {
  const auto edit = [](auto change) { return [=](const Tiles& t) { t.edit(kTile, change); }; };
  return {
      {"tile.unused", edit([](Mesh& m) {
         m.u.push_back(5), m.v.push_back(5), m.h.push_back(5);
         m.oct_normals.push_back({0, 0});
       })},
      {"height.range", edit([](Mesh& m) { std::swap(m.min_height, m.max_height); })},
      {"height.plausible", edit([](Mesh& m) { m.max_height = 40000; })},
      {"edge.short", edit([](Mesh& m) { m.west.resize(1); })},
      {"edge.index", edit([](Mesh& m) { m.west[0] = 60000; })},
      {"edge.off", edit([](Mesh& m) { std::swap(m.south, m.north); })},
      {"edge.missing", edit([](Mesh& m) { m.west.erase(m.west.begin() + 1); })},
      {"edge.corner", edit([](Mesh& m) { m.west.erase(m.west.begin()); })},
      {"edge.duplicate", edit([](Mesh& m) { m.west.push_back(m.west.back()); })},
      {"edge.order", edit([](Mesh& m) { std::ranges::reverse(m.west); })},
      {"mesh.corners", edit([](Mesh& m) { m.u[vertex_at(m, 0, 0)] = 1; })},
      {"mesh.orientation",
       edit([](Mesh& m) { std::swap(m.triangles.back()[1], m.triangles.back()[2]); })},
      {"mesh.degenerate", edit([](Mesh& m) {
         m.triangles.push_back({0, 0, m.triangles[0][1]});
       })},
      {"mesh.manifold", edit([](Mesh& m) { m.triangles.push_back(m.triangles[0]); })},
      {"mesh.cover", edit([](Mesh& m) { m.triangles.pop_back(); })},
      {"normal.down", edit([](Mesh& m) {  // the other side of the octahedron
         for (auto& n : m.oct_normals) n = {std::uint8_t(n[0] + 128), std::uint8_t(n[1] + 128)};
       })},
  };
}

std::map<std::string, Defect> culling_defects() {
  const auto edit = [](auto change) { return [=](const Tiles& t) { t.edit(kTile, change); }; };
  const auto scale_horizon = [=](double factor) {
    return edit([=](Mesh& m) {
      for (double& x : m.horizon_occlusion) x *= factor;
    });
  };
  return {
      {"sphere.contains", edit([](Mesh& m) { m.bounding_sphere[3] *= 0.99; })},
      {"sphere.loose", edit([](Mesh& m) { m.bounding_sphere[3] *= 3; })},
      {"center.inside", edit([](Mesh& m) { m.center[0] = -m.center[0]; })},
      {"horizon.scaled", edit([](Mesh& m) { m.horizon_occlusion = m.center; })},
      {"horizon.hides", scale_horizon(0.9999)},
      {"horizon.depth", edit([](Mesh& m) {
         sink(m, tiling::rect({12, 1463, 2813}));
       })},
      {"horizon.far", scale_horizon(1.5)},
  };
}

std::map<std::string, Defect> error_defects() {
  const auto says = [](const char* key, Json value) {
    return [=](const Tiles& t) { t.metadata(kTile, [&](Json& j) { j[key] = value; }); };
  };
  return {
      {"error.missing",
       [](const Tiles& t) { t.metadata(kTile, [](Json& j) { j.erase("max_error_m"); }); }},
      {"error.value", says("max_error_m", "small")},
      {"error.side", says("side", "left")},
      {"source.side", says("side", "above")},
      {"error.geometric", says("geometricerror", 0.5)},
      {"error.refines", says("geometricerror", 40)},  // the parent's is 37.6
      {"error.budget", says("max_error_m", 20)},
      {"crack.position",
       [](const Tiles& t) { t.edit(kTile, [](Mesh& m) { m.h[m.west[1]] ^= 1; }); }},
      {"crack.normal",
       [](const Tiles& t) { t.edit(kTile, [](Mesh& m) { m.oct_normals[m.west[1]][0] ^= 1; }); }},
      {"crack.level",
       [](const Tiles& t) {
         for (const char* tile : {kTile, kParent})
           t.metadata(tile, [](Json& j) {
             j["max_error_m"] = j["geometricerror"] = 0;
             j.erase("edge_error_m");
           });
       }},
      {"crack.stated",
       [](const Tiles& t) {
         for (const char* tile : {kTile, kParent})
           t.metadata(tile, [](Json& j) { j["edge_error_m"] = 0.001; });
       }},
      {"crack.stand-in",
       [](const Tiles& t) {
         fs::remove(t.path(kTile));
         t.metadata(kSibling, [](Json& j) { j["edge_error_m"] = 0.001; });
         t.metadata(kParent, [](Json& j) { j["max_error_m"] = j["edge_error_m"] = 0.001; });
       }},
      {"error.edge", says("edge_error_m", -1)},
      {"error.edge-large", says("edge_error_m", 1e9)},
      {"source.sparse", [](const Tiles& t) { fs::remove(t.path(kTile)); }},
      {"source.missing",
       [](const Tiles& t) {  // one level alone, and that with a hole
         for (const auto& entry : fs::directory_iterator(t.folder()))
           if (entry.is_directory() && entry.path().filename() != "12") fs::remove_all(entry);
         fs::remove(t.path(kTile));
       }},
      {"source.error", says("max_error_m", 0.01)},
      {"source.exact", says("max_error_m", 5)},
      {"source.height",
       [](const Tiles& t) { t.edit(kTile, [](Mesh& m) { m.max_height = m.min_height + 0.5f; }); }},
  };
}

class CheckTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    good_ = new test::TempDir;
    source_ = open(test::testdata("desert.asc"));
    BuildOptions options;
    options.output = good_->file("tiles");
    options.threads = 1;
    const auto built = build_tiles(source_, options);
    ASSERT_TRUE(built.has_value()) << built.error().what;
  }
  static void TearDownTestSuite() {
    source_.reset();
    delete good_;
  }

  static Findings check(const fs::path& folder, const std::optional<Surface>& source = source_,
                        int threads = 1) {
    const auto report = check_tiles(folder.string(), {.threads = threads, .source = source});
    EXPECT_TRUE(report.has_value()) << report.error().what;
    return report ? report->findings : Findings{};
  }

  static Findings with_defect(const Defect& defect) {
    const test::TempDir copy;
    fs::copy(good_->path() / "tiles", copy.path() / "tiles", fs::copy_options::recursive);
    defect(Tiles(copy.path() / "tiles"));
    return check(copy.path() / "tiles");
  }

  /// Every rule of the list is found more often than in the good pyramid.
  static void expect_found(const std::map<std::string, Defect>& defects) {
    const Findings before = check(good_->path() / "tiles");
    for (const auto& [id, defect] : defects) {
      const std::size_t r = index_of(id);
      const Findings after = with_defect(defect);
      EXPECT_GT(after[r].count, before[r].count) << id;
      const bool violation = kCheckRules[r].severity == Severity::violation;
      if (violation) {
        EXPECT_GT(after.total(Severity::violation), 0u) << id;
      }
    }
  }

  static test::TempDir* good_;
  static std::shared_ptr<const DemSource> source_;
};

test::TempDir* CheckTest::good_ = nullptr;
std::shared_ptr<const DemSource> CheckTest::source_;

TEST_F(CheckTest, AGoodPyramidHasNoViolation) {
  const auto report =
      check_tiles((good_->path() / "tiles").string(), {.threads = 2, .source = source_});
  ASSERT_TRUE(report.has_value());
  for (std::size_t r = 0; r < kCheckRuleCount; ++r)
    if (kCheckRules[r].severity == Severity::violation) {
      EXPECT_THAT(report->findings[r].examples, testing::IsEmpty()) << kCheckRules[r].id;
    }
  ASSERT_EQ(report->levels.size(), 13u);
  for (const CheckLevel& level : report->levels) {
    EXPECT_GE(level.posts, 60u * 50u) << level.level;
    EXPECT_LE(level.measured_m, level.stated_m + 1e-7) << level.level;
    EXPECT_GT(level.measured_m, 0) << level.level;
  }
}

TEST_F(CheckTest, FindsDefectsOfLayerAndAvailability) { expect_found(layer_defects()); }
TEST_F(CheckTest, FindsDefectsOfBytes) { expect_found(byte_defects()); }
TEST_F(CheckTest, FindsDefectsOfTheMesh) { expect_found(mesh_defects()); }
TEST_F(CheckTest, FindsDefectsOfCulling) { expect_found(culling_defects()); }
TEST_F(CheckTest, FindsDefectsOfErrorsAndNeighbours) { expect_found(error_defects()); }

TEST_F(CheckTest, ATileThatStatesNoErrorIsHeldToWhatClientsAssume) {
  const Findings found = with_defect([](const Tiles& t) {
    t.metadata(kTile, [](Json& j) { j.erase("max_error_m"); });
    t.edit(kTile, [](Mesh& m) { m.max_height = m.min_height + 0.5F; });
  });
  ASSERT_EQ(found[rule("source.error")].count, 1u);
  EXPECT_THAT(found[rule("source.error")].examples[0], testing::HasSubstr("none stated"));
}

TEST_F(CheckTest, FindsASourceThatIsElsewhere) {
  const auto other = open(test::testdata("rainier.tif"));
  // Both lie in some coarse tiles together; alone with the leaves they do not.
  const test::TempDir copy;
  fs::copy(good_->path() / "tiles" / "12", copy.path() / "12", fs::copy_options::recursive);
  EXPECT_EQ(check(copy.path(), other)[rule("source.overlap")].count, 1u);
}

TEST_F(CheckTest, ASourceThatIsNotTheTilesOwnIsNamedBesideItsViolations) {
  const std::string tiles = (good_->path() / "tiles").string();
  const auto note = [&](Surface surface) {
    const auto report = check_tiles(tiles, {.source = std::move(surface)});
    EXPECT_TRUE(report) << report.error().what;
    return report ? report->source_note : "";
  };
  EXPECT_EQ(note(source_), "");
  EXPECT_THAT(note(open(test::testdata("rainier.tif"))), testing::HasSubstr("another grid"));
  /// The same posts, all of them higher.
  class Higher final : public DemSource {
   public:
    explicit Higher(std::shared_ptr<const DemSource> of) : of_(std::move(of)) {}
    const DemInfo& info() const override { return of_->info(); }
    Result<HeightGrid> read(std::int64_t c, std::int64_t r, int cols, int rows) const override {
      return raised(of_->read(c, r, cols, rows));
    }
    Result<HeightGrid> read_decimated(std::int64_t c, std::int64_t r, int cols, int rows,
                                      int step) const override {
      return raised(of_->read_decimated(c, r, cols, rows, step));
    }
    void to_post(std::span<const Geographic> in, std::span<Vec2> out) const override {
      of_->to_post(in, out);
    }
    void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const override {
      of_->to_geographic(in, out);
    }
    bool is_plain_geographic() const override { return of_->is_plain_geographic(); }

   private:
    static Result<HeightGrid> raised(Result<HeightGrid> grid) {
      if (grid)
        for (float& z : grid->values()) z += 50000;
      return grid;
    }
    std::shared_ptr<const DemSource> of_;
  };
  EXPECT_THAT(note(std::shared_ptr<const DemSource>(std::make_shared<Higher>(source_))),
              testing::HasSubstr("other heights"));
}

TEST_F(CheckTest, EveryRuleHasAPlantedDefect) {
  // These have theirs in tests of their own; of lines and water in pyramid/shaped_tiles_test.cpp.
  std::set<std::string> planted = {"source.overlap", "source.flat", "source.water"};
  for (const auto& defects :
       {layer_defects(), byte_defects(), mesh_defects(), culling_defects(), error_defects()})
    for (const auto& [id, defect] : defects) planted.insert(id);
  for (const CheckRule& r : kCheckRules) EXPECT_TRUE(planted.contains(std::string(r.id))) << r.id;
}

TEST_F(CheckTest, TheReportDoesNotDependOnThreads) {
  const test::TempDir copy;
  fs::copy(good_->path() / "tiles", copy.path() / "tiles", fs::copy_options::recursive);
  const Tiles tiles(copy.path() / "tiles");
  for (const char* id : {"12/1462/2813", "12/1463/2813", "11/731/1406"})
    tiles.edit(id, [](Mesh& m) { m.h[m.west[1]] ^= 1, m.bounding_sphere[3] = 1; });
  const Findings one = check(tiles.folder(), source_, 1);
  const Findings four = check(tiles.folder(), source_, 4);
  for (std::size_t r = 0; r < kCheckRuleCount; ++r) {
    EXPECT_EQ(one[r].count, four[r].count);
    EXPECT_EQ(one[r].examples, four[r].examples);
  }
}

TEST_F(CheckTest, AnErrorFactorBreaksNoRule) {
  for (const double factor : {0.1, 5.0}) {
    const test::TempDir dir;
    BuildOptions options;
    options.output = dir.file("tiles");
    options.tiles.error_factor = factor;
    ASSERT_TRUE(build_tiles(source_, options).has_value());
    const auto report = check_tiles(options.output, {.error_factor = factor});
    ASSERT_TRUE(report.has_value());
    EXPECT_EQ(report->findings.total(Severity::violation), 0u) << factor;
  }
}

TEST_F(CheckTest, APartOfAPyramidThatListsFullDeepLevelsIsLookedAtAsFarAsItIsThere) {
  const test::TempDir copy;
  fs::copy(good_->path() / "tiles", copy.path() / "tiles", fs::copy_options::recursive);
  const Tiles tiles(copy.path() / "tiles");
  std::uint64_t listed = 0;
  tiles.layer([&](Json& json) {
    for (int z = 0; z <= 20; ++z) {
      json["available"][std::size_t(z)] = Json::array(
          {{{"startX", 0}, {"startY", 0}, {"endX", (2u << z) - 1}, {"endY", (1u << z) - 1}}});
      listed += std::uint64_t(2) << 2 * z;
    }
    json["maxzoom"] = 20;
  });
  const auto report = check_tiles(tiles.folder().string(), {});
  ASSERT_TRUE(report.has_value());
  std::uint64_t there = 0;
  for (const CheckLevel& level : report->levels) there += level.tiles;
  const auto& missing = report->findings[rule("available.missing")];
  EXPECT_EQ(missing.count, listed - there);
  EXPECT_EQ(missing.examples.size(), Findings::kExamples);
}

TEST_F(CheckTest, GzippedTilesAreReadToo) {
  const test::TempDir dir;
  BuildOptions options;
  options.output = dir.file("tiles");
  options.gzip = true;
  ASSERT_TRUE(build_tiles(source_, options).has_value());
  EXPECT_EQ(check(dir.path() / "tiles").total(Severity::violation), 0u);
}

TEST(Check, ADirectoryThatIsNotThereIsAnError) {
  const auto report = check_tiles("/no/such/directory", {});
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().code, Errc::not_found);
}

TEST(Check, TheRangeOfAHeaderMayReachFartherThanItsVertices) {
  const auto implausible = [](std::int32_t highest) {
    CheckedTile tile;
    tile.min_height = -10000, tile.max_height = 22767;  // steps of a metre, as of a whole world
    tile.u = {0, 32767, 0, 32767}, tile.v = {0, 0, 32767, 32767}, tile.h = {0, 0, 0, highest};
    tile.triangles = {{0, 1, 2}, {2, 1, 3}};
    tile.edges = {{{0, 2}, {0, 1}, {1, 3}, {2, 3}}};
    Findings findings;
    check_tile(tile, {0, 0, 0}, 1, findings);
    const auto rule = std::ranges::find(kCheckRules, "height.plausible", &CheckRule::id);
    return findings[std::size_t(rule - std::begin(kCheckRules))].count;
  };
  EXPECT_EQ(implausible(18848), 0u);
  EXPECT_EQ(implausible(20100), 1u);
}

TEST(CheckDecode, NamesWhatIsWrongWithTheBytesAndNothingElse) {
  struct Verdict {
    bool readable = false;
    std::set<std::string> faults;
    CheckedTile tile;
  };
  const auto verdict = [](const Bytes& bytes) {
    Findings findings;
    Verdict out;
    out.readable = check_decode(bytes, "tile", out.tile, findings);
    for (std::size_t r = 0; r < kCheckRuleCount; ++r)
      if (findings[r].count) out.faults.insert(std::string(kCheckRules[r].id));
    return out;
  };
  using testing::ElementsAre;
  using testing::IsEmpty;
  const Bytes good = proto::encode(square());
  EXPECT_TRUE(verdict(good).readable);
  EXPECT_THAT(verdict(good).faults, IsEmpty());

  Bytes beyond = good;
  beyond[first_code(good)] = 1;
  EXPECT_FALSE(verdict(beyond).readable);
  EXPECT_THAT(verdict(beyond).faults, ElementsAre("tile.index"));

  // An extension without bytes is whole, and no length of it is big endian.
  Bytes empty = good;
  add_extension(empty, 7, {});
  EXPECT_TRUE(verdict(empty).readable);
  EXPECT_THAT(verdict(empty).faults, ElementsAre("ext.unknown"));

  Bytes wet = good;
  EXPECT_FALSE(verdict(wet).tile.has_water_mask);
  add_extension(wet, 2, {255});
  EXPECT_TRUE(verdict(wet).tile.has_water_mask);
  EXPECT_THAT(verdict(wet).tile.water_mask, ElementsAre(255));
  EXPECT_THAT(verdict(wet).faults, IsEmpty());

  // 32-bit indices where 16 are right, behind the two bytes that such a maker pads with.
  Bytes wide = wide_indices();
  wide.insert(wide.begin() + 92 + 24, 2, 0);
  EXPECT_TRUE(verdict(wide).readable);
  EXPECT_THAT(verdict(wide).faults, ElementsAre("tile.index-width"));
}

TEST(Check, KnownFaultsOfForeignTiles) {
  TIND_NEEDS_SHARED_DATA(folder, "quantized-mesh");
  const auto faults = [&](const std::string& name) {
    const Bytes bytes = Tiles(folder).read(fs::path(folder) / (name + ".terrain"));
    Findings findings;
    CheckedTile tile;
    if (check_decode(bytes, name, tile, findings)) check_tile(tile, {9, 0, 0}, 1, findings);
    std::set<std::string> ids;
    for (std::size_t r = 0; r < kCheckRuleCount; ++r)
      if (findings[r].count) ids.insert(std::string(kCheckRules[r].id));
    return ids;
  };
  using testing::Contains;
  EXPECT_THAT(faults("heremaps/tile-opentin"), Contains("edge.short"));
  EXPECT_THAT(faults("heremaps/tile-opentin"), Contains("mesh.cover"));
  EXPECT_THAT(faults("cesium-native/tile.vertexnormals"), Contains("ext.big-endian"));
  EXPECT_THAT(faults("cesium-native/tile.unknownext"), Contains("ext.unknown"));
  EXPECT_THAT(faults("cesium-native/tile.32bitIndices"), Contains("mesh.degenerate"));
  EXPECT_THAT(faults("cesium-native/tile"), testing::Not(Contains("mesh.cover")));
  EXPECT_THAT(faults("cesium-native/tile"), testing::Not(Contains("tile.index-width")));
}

}  // namespace
}  // namespace tind
