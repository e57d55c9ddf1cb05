// Meshes as images: a pixel is the height of the tile's mesh at its centre, and the error is that
// of the tiles that are shown.

#include "terrain/images/mesh_image.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "tests/support/made_up_source.h"
#include "tests/support/projected_dem.h"
#include "tests/support/support.h"

namespace tind {
namespace {

constexpr int kPixels = 64;

class MeshImages : public ::testing::Test {
 protected:
  void SetUp() override {
    auto tiles = open_dem_tiles(surface_, {});
    ASSERT_TRUE(tiles) << tiles.error().what;
    tiles_ = std::move(*tiles);
    ask_ = {[this](TileId id) { return tiles_->available(id); },
            [this](TileId id, const std::stop_token& stop) -> Result<TileModel> {
              const auto bytes = tiles_->tile(id, stop);
              if (!bytes) return std::unexpected(bytes.error());
              errors_[id] = bytes->max_error_m;
              return decode_tile(id, bytes->bytes);
            }};
  }
  /// That has a place of the source.
  static web_mercator::Tile tile_at(int level, Geographic p) {
    const double side = std::ldexp(1., level);
    return *web_mercator::tile(level, std::int64_t(web_mercator::u_of(p.lon) * side),
                               std::int64_t(web_mercator::v_of(p.lat) * side));
  }

  Surface surface_ = std::make_shared<test::MadeUpSource>(test::rough_terrain(300, 250, 5),
                                                          Geographic{7.1, 45.9}, 4e-4);
  std::shared_ptr<const TileSet> tiles_;
  std::map<TileId, double> errors_;
  LevelTiles ask_;
};

TEST_F(MeshImages, HaveTheMeshAtTheCentresOfTheirPixelsAndTheErrorOfItsTiles) {
  for (const int level : {0, 6, 9, tiles_->layer().maxzoom, tiles_->layer().maxzoom + 1}) {
    const auto tile = tile_at(level, {7.15, 45.85});
    errors_.clear();
    const auto image = mesh_image(ask_, tile, kPixels);
    ASSERT_TRUE(image) << image.error().what;
    const auto shown = errors_;
    ASSERT_FALSE(shown.empty());
    double most = 0;
    for (const auto& [id, error] : shown) most = std::max(most, error);
    EXPECT_EQ(image->max_error_m, most) << level;
    ASSERT_FALSE(image->levels.empty());
    EXPECT_LE(image->levels.back(), level);
    EXPECT_EQ(image->levels.back(), std::min(level, tiles_->layer().maxzoom));
    const GeoRect rect = web_mercator::rect(tile);
    std::size_t outside = 0;
    for (int y = 0; y < kPixels; y += 7)
      for (int x = 0; x < kPixels; x += 5) {
        const double v = (tile.y + (y + .5) / kPixels) / std::ldexp(1., level);
        const Geographic at{rect.west + rect.width() * (x + .5) / kPixels, web_mercator::lat_of(v)};
        const auto seen = level_heights(ask_, {&at, 1}, level);
        ASSERT_TRUE(seen);
        const float height = image->heights[std::size_t(y) * kPixels + std::size_t(x)];
        EXPECT_NEAR(height, (*seen)[0] ? (*seen)[0]->height_m : 0, 1e-3)
            << level << " " << x << " " << y;
        if (!(*seen)[0]) ++outside;
      }
    EXPECT_EQ(outside > 0, image->outside_share > 0) << level;
  }
}

TEST_F(MeshImages, SayTheErrorOnlyWhereEveryTileDoes) {
  int asked = 0;
  const LevelTiles one_silent{ask_.available,
                              [&](TileId id, const std::stop_token& stop) -> Result<TileModel> {
                                auto model = ask_.tile(id, stop);
                                if (model && ++asked == 1) model->certificate.reset();
                                return model;
                              }};
  const auto tile = tile_at(8, {7.15, 45.85});
  const auto image = mesh_image(one_silent, tile, kPixels), said = mesh_image(ask_, tile, kPixels);
  ASSERT_TRUE(image && said);
  ASSERT_GT(asked, 1);
  EXPECT_FALSE(image->max_error_m);
  const auto has_error = [&](const MeshImage& of) {
    const auto pixels = mesh_pixels(of, proto::HeightCode::mapbox, tiles_->layer());
    return std::ranges::any_of(pixels.texts, [](const auto& text) {
      return text.first == "Largest error of the tiles in metres";
    });
  };
  EXPECT_FALSE(has_error(*image));
  EXPECT_TRUE(has_error(*said));
}

TEST_F(MeshImages, AreSmallerAsWebpThanAsPng) {
  const auto rainier = DemSource::open(std::vector<std::string>{test::testdata("rainier.tif")});
  ASSERT_TRUE(rainier) << rainier.error().what;
  const auto tiles = open_dem_tiles(*rainier, {});
  ASSERT_TRUE(tiles) << tiles.error().what;
  const LevelTiles ask{[&](TileId id) { return (*tiles)->available(id); },
                       [&](TileId id, const std::stop_token& stop) -> Result<TileModel> {
                         const auto bytes = (*tiles)->tile(id, stop);
                         if (!bytes) return std::unexpected(bytes.error());
                         return decode_tile(id, bytes->bytes);
                       }};
  const auto image = mesh_image(ask, tile_at(10, {-121.76, 46.85}), 512);
  ASSERT_TRUE(image) << image.error().what;
  const auto pixels = mesh_pixels(*image, proto::HeightCode::mapbox, (*tiles)->layer());
  EXPECT_LT(encode_image(pixels, proto::ImageFormat::webp).size(),
            encode_image(pixels, proto::ImageFormat::png).size());
}

TEST_F(MeshImages, AreDescribedWithAPlaceWhereTheTilesAre) {
  const auto described = [](const proto::LayerJson& layer) {
    return mesh_tile_json(layer, proto::HeightCode::mapbox, proto::ImageFormat::png, "x");
  };
  proto::LayerJson layer = tiles_->layer();
  const auto& [west, south, east, north] = layer.bounds;
  EXPECT_NEAR((*described(layer).center)[0], (west + east) / 2, 1e-9);
  EXPECT_NEAR((*described(layer).center)[1], (south + north) / 2, 1e-9);
  // Two tiles on either side of the antimeridian; and a fine layer in the west of a coarse world.
  layer.bounds = {-180, -60, 180, 60};
  layer.available = {{{0, 0, 1, 0}}, {{0, 0, 0, 0}, {3, 0, 3, 0}}};
  layer.maxzoom = 1;
  EXPECT_NEAR(std::abs((*described(layer).center)[0]), 180, 1e-9);
  EXPECT_EQ((*described(layer).center)[1], -30);
  layer.available = {{{0, 0, 1, 0}}, {{0, 1, 0, 1}}};
  EXPECT_EQ(*described(layer).center, (std::array<double, 2>{-135, 30}));
  layer.available.clear();  // as somebody else's may have it
  EXPECT_FALSE(described(layer).center);
}

TEST_F(MeshImages, ExistAsDeepAsTheTilesAndFailAsTheyDo) {
  const proto::LayerJson& layer = tiles_->layer();
  EXPECT_TRUE(has_mesh_image(layer, tile_at(layer.maxzoom, {7.15, 45.85})));
  EXPECT_FALSE(has_mesh_image(layer, tile_at(layer.maxzoom + 1, {7.15, 45.85})));
  EXPECT_FALSE(has_mesh_image(layer, tile_at(9, {-7.15, 45.85})));
  EXPECT_TRUE(has_mesh_image(layer, {0, 0, 0}));
  const LevelTiles broken{ask_.available, [](TileId, const std::stop_token&) -> Result<TileModel> {
                            return fail(Errc::io, "torn");
                          }};
  const auto image = mesh_image(broken, tile_at(9, {7.15, 45.85}), kPixels);
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, Errc::io);
}

int count_images(const proto::LayerJson& layer, int level) {
  int count = 0;
  const std::uint32_t side = 1u << level;
  for (std::uint32_t y = 0; y < side; ++y)
    for (std::uint32_t x = 0; x < side; ++x) count += has_mesh_image(layer, {level, x, y});
  return count;
}

TEST(MeshImagesOfADemAcross180, LieWhereItsTilesDo) {
  const test::TempDir dir;
  const auto dem =
      test::open_projected({"closely_across_it", "EPSG:32760", 780e3, 8050e3, 1000, 100, 70}, dir);
  ASSERT_TRUE(dem);
  const auto tiles = open_dem_tiles(dem, {});
  ASSERT_TRUE(tiles) << tiles.error().what;
  const proto::LayerJson& layer = (*tiles)->layer();
  ASSERT_EQ(layer.bounds[2] - layer.bounds[0], 360);
  for (int z = 1; z <= layer.maxzoom; ++z) {
    int count = 0;
    for (const proto::TileRange& r : layer.available[std::size_t(z)])
      for (std::uint32_t y = r.start_y; y <= r.end_y; ++y)
        for (std::uint32_t x = r.start_x; x <= r.end_x; ++x, ++count) {
          const GeoRect rect = tiling::rect({z, x, y});
          const double lat = std::clamp((rect.south + rect.north) / 2, layer.bounds[1] + 1e-9,
                                        layer.bounds[3] - 1e-9);
          const double side = std::ldexp(1., z);
          const auto image = web_mercator::tile(z, std::int64_t(x / 2),
                                                std::int64_t(web_mercator::v_of(lat) * side));
          EXPECT_TRUE(has_mesh_image(layer, *image)) << z << "/" << x << "/" << y;
        }
    EXPECT_LE(count_images(layer, z), 2 * count) << z;
  }
}

TEST(MeshImagesOfLayers, GoOnWhereACoarseOneEnds) {
  // A coarse layer all over the east down to level 3, a fine one in a tile of it down to 6.
  proto::LayerJson layer;
  layer.bounds = {0, -90, 180, 90};
  layer.maxzoom = 6;
  layer.available = {{{0, 0, 1, 0}},   {{2, 0, 3, 1}},     {{4, 0, 7, 3}},    {{8, 0, 15, 7}},
                     {{24, 8, 24, 8}}, {{48, 16, 48, 16}}, {{97, 33, 97, 33}}};
  for (int z = 0; z <= 6; ++z)  // all of the eastern half of the map, as without the fine one
    EXPECT_EQ(count_images(layer, z), z == 0 ? 1 : 1 << (2 * z - 1)) << z;
  // Without the coarse one below level 1, only the fine one's way down.
  layer.available = {{{0, 0, 1, 0}},   {{3, 1, 3, 1}},     {{6, 2, 6, 2}},    {{12, 4, 12, 4}},
                     {{24, 8, 24, 8}}, {{48, 16, 48, 16}}, {{97, 33, 97, 33}}};
  for (int z = 1; z <= 6; ++z) EXPECT_LE(count_images(layer, z), 2) << z;
}

TEST(MeshImagesOfAnyTiles, ExistAboveEachThatDoes) {
  std::mt19937 random(7);
  for (int round = 0; round < 60; ++round) {
    constexpr int kLast = 5;
    proto::LayerJson layer;
    layer.maxzoom = kLast;
    layer.available.assign(kLast + 1, {});
    layer.available[0] = {{0, 0, 1, 0}};
    std::vector<TileId> above = {{0, 0, 0}, {0, 1, 0}};
    for (int z = 1; z <= kLast; ++z) {
      std::vector<TileId> here;
      for (const TileId& t : above)
        for (int part = 0; part < 4; ++part)
          if (random() % 3 != 0) here.push_back(t.child(part % 2, part / 2));
      for (const TileId& t : here) layer.available[std::size_t(z)].push_back({t.x, t.y, t.x, t.y});
      above = here;
    }
    for (int z = 1; z <= kLast; ++z)
      for (std::uint32_t y = 0; y < 1u << z; ++y)
        for (std::uint32_t x = 0; x < 1u << z; ++x)
          if (has_mesh_image(layer, {z, x, y})) {
            ASSERT_TRUE(has_mesh_image(layer, {z - 1, x / 2, y / 2})) << z << "/" << x << "/" << y;
          }
  }
}

}  // namespace
}  // namespace tind
