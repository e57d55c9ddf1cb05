// Tiles whose meshes are made for an image's sake: the promises of all tiles, and the colours.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "terrain/check/check.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/build/repair.h"
#include "terrain/pyramid/make/make_tile.h"
#include "terrain/pyramid/plan/tile_method.h"
#include "terrain/pyramid/plan/tile_version.h"
#include "terrain/raster/image_colours.h"
#include "terrain/simplify/common/held_colours.h"
#include "terrain/simplify/method_text.h"
#include "terrain/tile/level_colours.h"
#include "tests/support/made_up_source.h"

namespace tind {
namespace {

using test::MadeUpSource;
using test::TempDir;

/// Land and water with a shore between them that knows nothing of the terrain.
class Shore : public ImageColours {
 public:
  explicit Shore(GeoRect bounds = {7.1, 45.8, 7.2, 45.9}, std::string fingerprint = "shore")
      : bounds_(bounds), fingerprint_(std::move(fingerprint)) {}

  void at(std::span<const Geographic> places, double,
          std::span<std::optional<Linear>> found) const override {
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Geographic& p = places[i];
      if (!bounds_.contains(p)) continue;
      const double shore = 45.85 + 0.3 * (p.lon - 7.15) + 0.006 * std::sin(300 * p.lon);
      found[i] = p.lat > shore ? Linear{.8f, .7f, .2f} : Linear{.1f, .2f, .6f};
    }
  }
  const std::string& fingerprint() const override { return fingerprint_; }
  const GeoRect& bounds() const override { return bounds_; }

 private:
  GeoRect bounds_;
  std::string fingerprint_;
};

Surface terrain() {
  return std::make_shared<MadeUpSource>(test::rough_terrain(50, 50, 3), Geographic{7.1, 45.9},
                                        .002);
}

TileSetOptions options(const std::string& method, std::shared_ptr<const ImageColours> image = {}) {
  TileSetOptions o{.max_error_m = 15};
  o.method = *method_from_text(method);
  o.colours = std::move(image);
  return o;
}

struct Shown {
  std::size_t triangles = 0;
  double error = 0;
};

/// Of all tiles.
Shown shown(const TileSetOptions& o) {
  const Surface surface = terrain();
  const auto plan = TilePlan::make(surface, *scan_heights(surface), o);
  const Shore image;
  Shown all;
  const TileOrder order = plan->order();
  for (std::size_t k = 0; k < order.size(); ++k) {
    const auto tile = model_tile(surface, *plan, order[k]);
    if (!tile) throw std::runtime_error(tile.error().what);
    constexpr int kCells = 100;
    std::vector<Geographic> places;
    for (int j = 0; j <= kCells; ++j)
      for (int i = 0; i <= kCells; ++i)
        places.push_back(place_of(tiling::rect(tile->id), {i * double(kTileExtent) / kCells,
                                                           j * double(kTileExtent) / kCells, 0}));
    const auto nodes = level_colours(places, tile->id.level, image);
    all.triangles += tile->mesh.triangles.size();
    if (nodes.empty()) continue;
    const HeldColours colours(kCells, kTileExtent, nodes);
    for (const Triangle& t : tile->mesh.triangles)
      all.error += colours.error(tile->mesh.vertices[t[0]], tile->mesh.vertices[t[1]],
                                 tile->mesh.vertices[t[2]]);
  }
  return all;
}

TEST(ColouredTiles, show_the_image_better_by_as_many_triangles) {
  const auto image = std::make_shared<const Shore>();
  const Shown plain = shown(options("attribute-qem attribute-weight=0"));
  const Shown moved = shown(options("attribute-qem attribute-weight=0", image));
  EXPECT_EQ(moved.triangles, plain.triangles);
  EXPECT_LT(moved.error, 0.85 * plain.error);
  const Shown held = shown(options("attribute-qem", image));
  EXPECT_LT(held.error, 0.8 * moved.error);
}

Result<BuildReport> build(const TileSetOptions& o, const std::string& output, int threads = 2,
                          bool force = false) {
  return build_tiles(terrain(), {.tiles = o, .output = output, .threads = threads, .force = force});
}

std::map<std::string, std::string> tiles_in(const std::string& directory) {
  std::map<std::string, std::string> tiles;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(directory)) {
    if (entry.path().extension() != ".terrain") continue;
    std::ifstream in(entry.path(), std::ios::binary);
    tiles[std::filesystem::relative(entry.path(), directory).string()] = {
        std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  return tiles;
}

TEST(ColouredTiles, keep_every_promise_for_any_number_of_threads) {
  const TempDir folder;
  const auto image = std::make_shared<const Shore>();
  for (const char* method :
       {"attribute-qem", "attribute-qem attributes=colour", "attribute-qem attribute-weight=3",
        "attribute-qem attributes=colour+normal attribute-metric=separate"}) {
    for (const Side side : {Side::both, Side::above}) {
      TileSetOptions o = options(method, image);
      o.side = side;
      const std::string name = std::string(method) + name_of(side), one = folder.file(name),
                        four = folder.file(name + "4");
      const auto built = build(o, one, 1);
      ASSERT_TRUE(built) << built.error().what;
      EXPECT_EQ(built->over_budget, 0u) << name;
      EXPECT_LE(built->by_bounded, built->tiles / 4) << name;
      ASSERT_TRUE(build(o, four, 4));
      const auto found = check_tiles(one, {.source = terrain()});
      ASSERT_TRUE(found) << found.error().what;
      EXPECT_EQ(found->findings.total(Severity::violation), 0u) << name;
      EXPECT_TRUE(tiles_in(one) == tiles_in(four)) << name;
    }
  }
}

TEST(ColouredTiles, of_another_image_are_others) {
  const Surface surface = terrain();
  const auto version = [&](const TileSetOptions& o) {
    const auto plan = TilePlan::make(surface, HeightRange{}, o);
    return plan ? tile_version(surface, *plan, "") : plan.error().what;
  };
  const GeoRect box{7.1, 45.8, 7.2, 45.9};
  const auto one = std::make_shared<const Shore>(box, "one"),
             other = std::make_shared<const Shore>(box, "other");
  EXPECT_NE(version(options("attribute-qem", one)), version(options("attribute-qem", other)));
  EXPECT_NE(version(options("attribute-qem", one)), version(options("attribute-qem")));
  // Where the image has no say, nothing depends on it.
  for (const char* method : {"bounded", "qem", "attribute-qem attributes=normal",
                             "attribute-qem attribute-metric=ignored"})
    EXPECT_EQ(version(options(method, one)), version(options(method))) << method;

  const TempDir folder;
  const std::string output = folder.file("tiles");
  const auto first = build(options("attribute-qem", one), output);
  ASSERT_TRUE(first) << first.error().what;
  const auto same = build(options("attribute-qem", one), output);
  ASSERT_TRUE(same);
  EXPECT_EQ(same->built, 0u);
  const auto again = build(options("attribute-qem", other), output);
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->built, first->tiles);
  EXPECT_FALSE(again->update.everything.empty());
  const auto repaired = repair_tiles(surface, output, 1, {});
  ASSERT_FALSE(repaired);
  EXPECT_EQ(repaired.error().code, Errc::unsupported);
}

TEST(ColouredTiles, need_an_image_that_is_there) {
  const Surface surface = terrain();
  const auto code = [&](const TileSetOptions& o) {
    const auto plan = TilePlan::make(surface, HeightRange{}, o);
    return plan ? Errc::internal : plan.error().code;
  };
  for (const char* method :
       {"attribute-qem attributes=colour", "attribute-qem attributes=colour+normal"})
    EXPECT_EQ(code(options(method)), Errc::invalid_argument) << method;
  const auto elsewhere = std::make_shared<const Shore>(GeoRect{8, 45, 9, 46});
  EXPECT_EQ(code(options("attribute-qem", elsewhere)), Errc::invalid_argument);
  EXPECT_EQ(code(options("attribute-qem attributes=normal", elsewhere)), Errc::internal);
  EXPECT_EQ(code(options("bounded", elsewhere)), Errc::internal);
}

TEST(HeldColours, err_by_what_the_corners_do_not_say) {
  std::vector<HeldColours::Colour> nodes(25, {0, 0, 0});
  for (int j = 0; j < 5; ++j)
    for (int i = 0; i < 5; ++i) nodes[std::size_t(5 * j + i)] = {i * .1f, j * .1f, .5f};
  const HeldColours even(4, 400, nodes);
  const Vec3 a{0, 0, 0}, b{400, 0, 0}, c{0, 400, 0};
  EXPECT_NEAR(even.error(a, b, c), 0, 1e-12);
  EXPECT_NEAR(even.at(150, 50)[0], .15, 1e-6);
  EXPECT_NEAR(even.at(150, 50)[1], .05, 1e-6);
  nodes[6][2] += .5f;  // (100, 100), inside
  nodes[24][2] += 1;   // outside
  EXPECT_NEAR(HeldColours(4, 400, nodes).error(a, b, c), .25, 1e-6);
  EXPECT_EQ(even.error(a, b, {800, 0, 0}), 0);  // no area
}

}  // namespace
}  // namespace tind
