// What clients of a level see is the tiles' meshes, triangle by triangle, within the error that
// they state.

#include "terrain/tile/level_heights.h"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <random>

#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/mesh/triangle_locator.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/surface/height_field.h"
#include "tests/support/support.h"

namespace tind {
namespace {

/// A square of random height over n x n posts whose cells are split this way and that.
Tin random_mesh(std::mt19937& random, int n) {
  std::uniform_real_distribution<double> height(0, 100);
  Tin mesh;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) mesh.vertices.push_back({double(x), double(y), height(random)});
  for (int y = 0; y + 1 < n; ++y)
    for (int x = 0; x + 1 < n; ++x) {
      const auto a = std::uint32_t(y * n + x), b = a + 1, c = a + std::uint32_t(n), d = c + 1;
      if (random() % 2) {
        mesh.triangles.push_back({a, b, d});
        mesh.triangles.push_back({a, d, c});
      } else {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({b, d, c});
      }
    }
  return mesh;
}

TEST(TriangleLocator, FindsEachTriangleByAPlaceInIt) {
  std::mt19937 random(1);
  const Tin mesh = random_mesh(random, 30);
  const TriangleLocator locator(mesh);
  std::uniform_real_distribution<double> share(0.05, 1);
  for (const Triangle& t : mesh.triangles) {
    double s[3] = {share(random), share(random), share(random)};
    const double sum = s[0] + s[1] + s[2];
    Vec3 p;
    for (int k = 0; k < 3; ++k) p = p + mesh.vertices[t[std::size_t(k)]] * (s[k] / sum);
    const auto height = locator.height_at({p.x, p.y});
    ASSERT_TRUE(height);
    EXPECT_NEAR(*height, p.z, 1e-9);
  }
}

TEST(TriangleLocator, HasVerticesAndEdgesAndNothingOutside) {
  std::mt19937 random(2);
  const Tin mesh = random_mesh(random, 9);
  const TriangleLocator locator(mesh);
  for (const Vec3& v : mesh.vertices) EXPECT_NEAR(locator.height_at({v.x, v.y}).value(), v.z, 1e-9);
  for (const double y : {0.0, 8.0}) EXPECT_TRUE(locator.height_at({3.5, y}));
  for (const Vec2 outside : {Vec2{-0.01, 4}, Vec2{8.01, 4}, Vec2{4, -1}, Vec2{4, 9}})
    EXPECT_FALSE(locator.height_at(outside));
  EXPECT_FALSE(TriangleLocator(Tin{}).height_at({0, 0}));
}

class LevelHeights : public ::testing::Test {
 protected:
  void SetUp() override {
    auto source = DemSource::open(std::array{test::testdata("rainier.tif")},
                                  {.environment = test::environment()});
    ASSERT_TRUE(source) << source.error().what;
    source_ = *source;
    auto tiles = open_dem_tiles(Surface(source_), {});
    ASSERT_TRUE(tiles) << tiles.error().what;
    tiles_ = std::move(*tiles);
    ask_ = {[this](TileId id) { return tiles_->available(id); },
            [this](TileId id, const std::stop_token& stop) -> Result<TileModel> {
              ++made_[id];
              const auto bytes = tiles_->tile(id, stop);
              if (!bytes) return std::unexpected(bytes.error());
              return decode_tile(id, bytes->bytes);
            }};
  }
  std::shared_ptr<const DemSource> source_;
  std::shared_ptr<const TileSet> tiles_;
  std::map<TileId, int> made_;
  LevelTiles ask_;
};

TEST_F(LevelHeights, AreWithinTheStatedErrorOfEveryPost) {
  std::vector<Geographic> places;
  std::vector<Vec2> posts;
  std::mt19937 random(3);
  const DemInfo& info = source_->info();
  for (int i = 0; i < 2000; ++i)
    posts.push_back(
        {double(random() % std::uint64_t(info.cols)), double(random() % std::uint64_t(info.rows))});
  places.resize(posts.size());
  source_->to_geographic(posts, places);
  for (const int level : {8, 10, 24}) {
    made_.clear();
    const auto seen = level_heights(ask_, places, level);
    ASSERT_TRUE(seen) << seen.error().what;
    for (const auto& [id, times] : made_) EXPECT_EQ(times, 1) << id.text();
    double worst = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      ASSERT_TRUE((*seen)[i]) << i;
      ASSERT_TRUE((*seen)[i]->max_error_m);
      EXPECT_LE((*seen)[i]->tile.level, level);
      EXPECT_TRUE(tiling::rect((*seen)[i]->tile).contains(places[i]));
      const auto post = height_at(Surface(source_), places[i]);
      ASSERT_TRUE(post);
      if (post->height.coverage != Coverage::value) continue;
      const double off = std::abs((*seen)[i]->height_m - post->height.height_m);
      EXPECT_LE(off, *(*seen)[i]->max_error_m + 1e-6) << i;
      worst = std::max(worst, off);
    }
    EXPECT_GT(worst, 0) << "a mesh is simpler than its DEM";
  }
}

TEST_F(LevelHeights, AreThoseOfAnyTurnOfTheGlobe) {
  const GeoRect b = source_->info().bounds;
  const Geographic place{(b.west + b.east) / 2, (b.south + b.north) / 2};
  const Geographic turned{place.lon + 360, place.lat};
  const auto one = level_heights(ask_, {&place, 1}, 9),
             other = level_heights(ask_, {&turned, 1}, 9);
  ASSERT_TRUE(one && other && (*one)[0] && (*other)[0]);
  EXPECT_EQ((*one)[0]->tile, (*other)[0]->tile);
  EXPECT_NEAR((*one)[0]->height_m, (*other)[0]->height_m, 1e-6);
}

TEST_F(LevelHeights, AreNothingWhereThereIsNoTile) {
  const LevelTiles none{[](TileId) { return false; }, ask_.tile};
  const Geographic place{0, 0};
  const auto seen = level_heights(none, {&place, 1}, 5);
  ASSERT_TRUE(seen);
  EXPECT_FALSE((*seen)[0]);
}

}  // namespace
}  // namespace tind
