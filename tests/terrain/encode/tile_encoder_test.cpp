// Every format of the table says the same of the same tile.

#include "terrain/encode/tile_encoder.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "terrain/encode/glb_tile.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/pyramid/make/make_tile.h"
#include "terrain/pyramid/plan/plan_source.h"
#include "terrain/tile/normals.h"
#include "tests/support/drawn_glb.h"
#include "tests/support/made_up_source.h"

namespace tind {
namespace {

/// Some tiles of a rough terrain, of a coarse, a middle and the finest level, two of
/// them neighbours.
class EncodedTiles : public ::testing::Test {
 protected:
  EncodedTiles() {
    TileSetOptions options;
    options.effort = Effort::fast;
    auto plan = plan_source(source_, options, "", 1);
    EXPECT_TRUE(plan) << plan.error().what;
    const double lon = 7.15, lat = 45.85;
    for (const int z : {0, plan->max_level() / 2, plan->max_level()}) {
      const double side = tiling::tile_degrees(z);
      const auto id =
          tiling::tile(z, std::int64_t((lon + 180) / side), std::int64_t((lat + 90) / side));
      EXPECT_TRUE(plan->available(*id));
      for (const TileId tile : {*id, TileId{z, id->x ^ 1, id->y}}) {
        auto model = model_tile(source_, *plan, tile);
        EXPECT_TRUE(model) << model.error().what;
        tiles_.push_back(std::move(*model));
      }
    }
  }

  test::MadeUpSource source_{test::rough_terrain(300, 300, 1), {7.1, 45.9}, 4e-4};
  std::vector<TileModel> tiles_;
};

struct DecodedGlb {
  nlohmann::json extras;
  test::DrawnPart surface;
};

DecodedGlb decode_glb(const std::vector<std::uint8_t>& bytes) {
  test::DrawnGlb glb = test::read_glb(bytes);
  return {std::move(glb.extras), std::move(glb.parts[0])};
}

TEST_F(EncodedTiles, QuantizedMeshLosesNothing) {
  for (const TileModel& tile : tiles_) {
    const auto bytes = encode_quantized_mesh(tile);
    auto back = decode_tile(tile.id, bytes);
    ASSERT_TRUE(back) << back.error().what;
    EXPECT_EQ(back->mesh.vertices, tile.mesh.vertices);
    EXPECT_EQ(back->mesh.triangles, tile.mesh.triangles);
    EXPECT_EQ(back->normals, tile.normals);
    EXPECT_EQ(back->certificate->max_error_m, tile.certificate->max_error_m);
    EXPECT_EQ(back->certificate->edge_error_m, tile.certificate->edge_error_m);
    EXPECT_EQ(back->posts, tile.posts);
    back->descendants = tile.descendants;  // not read back
    EXPECT_EQ(encode_quantized_mesh(*back), bytes);
  }
}

TEST_F(EncodedTiles, EveryEncodingCanBeMadeOfQuantizedMesh) {
  for (const TileEncoder& encoder : tile_encoders())
    for (const TileModel& tile : tiles_) {
      auto stored = decode_tile(tile.id, encode_quantized_mesh(tile));
      ASSERT_TRUE(stored);
      stored->descendants = tile.descendants;
      EXPECT_EQ(encoder.encode(*stored), encoder.encode(tile)) << encoder.name;
    }
}

TEST_F(EncodedTiles, AGlbStatesWhatItRoundsOff) {
  for (const TileModel& tile : tiles_) {
    const DecodedGlb glb = decode_glb(encode_glb(tile));
    ASSERT_EQ(glb.surface.vertices.size(), tile.mesh.vertices.size());
    const double rounding = glb.extras["rounding_m"];
    EXPECT_LT(rounding, glb_lattice(tile.id.level));
    EXPECT_GE(glb.extras["max_error_m"].get<double>(),
              tile.certificate->max_error_m + rounding / 2);
    for (std::size_t i = 0; i < glb.surface.vertices.size(); ++i) {
      const Vec3& v = tile.mesh.vertices[i];
      const Vec3 exact = wgs84::to_ecef(place_of(tiling::rect(tile.id), v), v.z);
      EXPECT_LE(length(glb.surface.vertices[i] - exact), rounding) << tile.id.text();
      EXPECT_NEAR(length(glb.surface.normals[i] - oct_decode(tile.normals[i])), 0, 1e-6);
    }
  }
}

TEST_F(EncodedTiles, NoPostIsFartherFromAGlbAsItIsDrawnThanItStates) {
  for (const TileModel& tile : tiles_) {
    const DecodedGlb glb = decode_glb(encode_glb(tile));
    const test::DrawnError measured =
        test::drawn_error(glb.surface, source_, tiling::rect(tile.id));
    EXPECT_LE(measured.worst_m, glb.extras["max_error_m"].get<double>()) << tile.id.text();
    EXPECT_GE(measured.posts, tile.posts > 0 ? 20 : 0) << tile.id.text();
  }
}

TEST(GlbTile, StatesThatStraightTrianglesLieBelowACurvedEarth) {
  const test::MadeUpSource sea(HeightGrid(300, 300, 10.0f), {7.1, 45.9}, 4e-4);
  const auto plan = plan_source(sea, {}, "", 1);
  ASSERT_TRUE(plan) << plan.error().what;
  for (const int z : {5, 6, 7, 8}) {
    const double side = tiling::tile_degrees(z);
    const auto id = tiling::tile(z, std::int64_t(187.15 / side), std::int64_t(135.85 / side));
    const auto tile = model_tile(sea, *plan, *id);
    ASSERT_TRUE(tile) << tile.error().what;
    const DecodedGlb glb = decode_glb(encode_glb(*tile));
    const test::DrawnError measured = test::drawn_error(glb.surface, sea, tiling::rect(*id));
    EXPECT_GT(measured.worst_m, tile->certificate->max_error_m + 1) << id->text();
    EXPECT_LE(measured.worst_m, glb.extras["max_error_m"].get<double>()) << id->text();
  }
}

TEST_F(EncodedTiles, RoundingAddsLittleToTheErrorOfAGlb) {
  for (const TileModel& tile : tiles_) {
    const SpaceError space = space_error(tile);
    EXPECT_LT(space.moved_m, glb_lattice(tile.id.level));
    // What clients assume of the level is never used up by straightness.
    EXPECT_LE(space.shift_m, tile.displayed_error_m / 2 + space.moved_m) << tile.id.text();
    EXPECT_LE(space.edge_m, tile.displayed_error_m / 4 + 3 * space.moved_m) << tile.id.text();
  }
}

TEST_F(EncodedTiles, NeighboursInGlbMeetToTheBit) {
  for (std::size_t pair = 0; pair < tiles_.size(); pair += 2) {
    const TileModel &a = tiles_[pair], &b = tiles_[pair + 1];
    const bool a_is_west = a.id.x < b.id.x;
    const DecodedGlb in_a = decode_glb(encode_glb(a));
    const DecodedGlb in_b = decode_glb(encode_glb(b));
    int shared = 0;
    for (std::size_t i = 0; i < in_a.surface.vertices.size(); ++i)
      for (std::size_t j = 0; j < in_b.surface.vertices.size(); ++j) {
        const Vec3 &p = a.mesh.vertices[i], &q = b.mesh.vertices[j];
        if (p.x != (a_is_west ? kTileExtent : 0) || q.x != (a_is_west ? 0 : kTileExtent)) continue;
        if (p.y != q.y) continue;
        ++shared;
        EXPECT_EQ(in_a.surface.vertices[i], in_b.surface.vertices[j]);
      }
    EXPECT_GE(shared, 2) << a.id.text();
  }
}

TEST(TileEncoders, AreFoundByTheirExtension) {
  for (const TileEncoder& encoder : tile_encoders())
    EXPECT_EQ(encoder_of_extension(encoder.extension), &encoder);
  EXPECT_EQ(encoder_of_extension("exe"), nullptr);
}

}  // namespace
}  // namespace tind
