// Every tile of a whole small pyramid to its parent's part: all succeed, nothing flips, and
// neighbours agree along the edges they share, at every parameter value.

#include "terrain/pyramid/make/tile_transition.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "proto/tile/quantized_mesh.h"
#include "terrain/base/file_io.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/raster/dem_source.h"
#include "terrain/store/tile_set.h"
#include "tests/support/support.h"

namespace tind {
namespace {

class TileTransition : public ::testing::Test {
 protected:
  void SetUp() override {
    auto source = DemSource::open(std::vector{test::testdata("rainier.tif")});
    ASSERT_TRUE(source) << source.error().what;
    TileSetOptions options;
    options.max_error_m = 20;
    auto set = open_dem_tiles(std::move(*source), options);
    ASSERT_TRUE(set) << set.error().what;
    set_ = std::move(*set);
    const proto::LayerJson& layer = set_->layer();
    for (int z = 0; z <= layer.maxzoom; ++z) {
      for (const proto::TileRange& r : layer.available[std::size_t(z)]) {
        for (std::uint32_t x = r.start_x; x <= r.end_x; ++x) {
          for (std::uint32_t y = r.start_y; y <= r.end_y; ++y) {
            auto tile = set_->tile({z, x, y}, {});
            ASSERT_TRUE(tile) << tile.error().what;
            tiles_[{z, x, y}] = std::move(*tile);
          }
        }
      }
    }
    for (const auto& [id, tile] : tiles_) {
      if (id.level == 0) continue;
      auto made = tile_transition(id, tile.bytes, tiles_.at(id.parent()).bytes);
      ASSERT_TRUE(made) << made.error().what;
      ways_[id] = from_wire(*made);
    }
  }

  std::unique_ptr<TileSet> set_;
  std::map<TileId, TileBytes> tiles_;
  std::map<TileId, TerrainTransition> ways_;
};

/// The mesh's vertices on a side: place along it -> height.
std::map<double, double> side(const Tin& mesh, bool vertical, double at) {
  std::map<double, double> out;
  for (const Vec3& v : mesh.vertices)
    if ((vertical ? v.x : v.y) == at) out[vertical ? v.y : v.x] = v.z;
  return out;
}

TEST_F(TileTransition, NeighboursAgreeAtEveryParameter) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(0, 1);
  std::size_t edges = 0;
  std::vector<double> parameters = {0, 1};
  for (int i = 0; i < 8; ++i) parameters.push_back(anywhere(random));
  for (const double s : parameters) {
    std::map<TileId, Tin> meshes;
    for (const auto& [id, way] : ways_) meshes[id] = mesh_at(way, s);
    for (const auto& [id, mesh] : meshes) {
      const auto east = meshes.find({id.level, id.x + 1, id.y});
      const auto north = meshes.find({id.level, id.x, id.y + 1});
      if (east != meshes.end()) {
        EXPECT_EQ(side(mesh, true, 32767), side(east->second, true, 0)) << id.text() << " " << s;
        ++edges;
      }
      if (north != meshes.end()) {
        EXPECT_EQ(side(mesh, false, 32767), side(north->second, false, 0)) << id.text() << " " << s;
        ++edges;
      }
    }
  }
  EXPECT_GT(edges, 1000u);
}

TEST_F(TileTransition, NothingFlipsAndTheSquareIsCovered) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> anywhere(0, 1);
  for (const auto& [id, way] : ways_) {
    for (int i = 0; i < 6; ++i) {
      const double s = anywhere(random);
      const Tin mesh = mesh_at(way, s);
      double area = 0;
      for (const Triangle& t : mesh.triangles) {
        const double twice =
            orient2d(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
        ASSERT_GE(twice, -1e-6) << id.text() << " at " << s;
        area += twice / 2;
      }
      ASSERT_NEAR(area / 32767 / 32767, 1, 1e-9) << id.text() << " at " << s;
    }
  }
}

TEST_F(TileTransition, TheCoarseEndHasTheParentsVertices) {
  std::size_t seen = 0;
  for (const auto& [id, way] : ways_) {
    std::map<std::pair<double, double>, double> part;
    for (const Vec3& v : mesh_at(way, 0).vertices) part[{v.x, v.y}] = v.z;
    const auto parent = proto::decode(tiles_.at(id.parent()).bytes);
    const double low = parent->min_height, range = double(parent->max_height) - low;
    for (std::size_t i = 0; i < parent->u.size(); ++i) {
      const double x = 2.0 * parent->u[i] - (id.x % 2 ? 32767 : 0);
      const double y = 2.0 * parent->v[i] - (id.y % 2 ? 32767 : 0);
      if (x < 0 || x > 32767 || y < 0 || y > 32767) continue;
      const auto found = part.find({x, y});
      ASSERT_NE(found, part.end()) << id.text() << " at " << x << ", " << y;
      EXPECT_EQ(found->second, low + parent->h[i] * range / 32767);
      ++seen;
    }
  }
  EXPECT_GT(seen, 1000u);
}

TEST(TileTransitionOfLayers, TilesOfManySliversAreLaidOverEachOther) {
  // Two layers and a shore: the parent's part crosses the tile's edges 2000 times.
  const auto bytes = [](const char* name) {
    const auto read = read_whole_file(test::testdata(name));
    return std::vector<std::uint8_t>(read->begin(), read->end());
  };
  const auto made = tile_transition({10, 341, 712}, bytes("slivers_10_341_712.terrain"),
                                    bytes("slivers_9_170_356.terrain"));
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_TRUE(proto::decode_transition(proto::encode(*made)));
}

}  // namespace
}  // namespace tind
