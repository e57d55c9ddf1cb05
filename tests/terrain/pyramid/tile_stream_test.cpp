// Tiles as progressive meshes: they end in the tile, keep its border all the way, and what they say
// of their error holds for every post.

#include "terrain/pyramid/make/tile_stream.h"

#include <gtest/gtest.h>

#include <set>

#include "proto/tile/quantized_mesh.h"
#include "terrain/mesh/validity.h"
#include "terrain/progressive/stream/progressive_cursor.h"
#include "terrain/progressive/stream/progressive_stream.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/store/tile_set.h"
#include "terrain/surface/tile_posts.h"
#include "tests/support/made_up_tiles.h"
#include "tests/support/support.h"

namespace tind {
namespace {

constexpr double kExtent = 32767;

class TileStream : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto source = DemSource::open(std::vector{test::testdata("rainier.tif")});
    ASSERT_TRUE(source) << source.error().what;
    dem_ = *source;
    TileSetOptions options;
    options.max_error_m = 4;
    auto set = open_dem_tiles(std::move(*source), options);
    ASSERT_TRUE(set) << set.error().what;
    set_ = std::move(*set);
  }
  static void TearDownTestSuite() { set_.reset(), dem_.reset(); }

  /// The tile of a level that holds the middle of the DEM.
  static TileId middle(int level) {
    const auto& b = set_->layer().bounds;
    const double side = tiling::tile_degrees(level);
    return *tiling::tile(level, std::int64_t(((b[0] + b[2]) / 2 + 180) / side),
                         std::int64_t(((b[1] + b[3]) / 2 + 90) / side));
  }

  static std::shared_ptr<const DemSource> dem_;
  static std::unique_ptr<TileSet> set_;
};
std::shared_ptr<const DemSource> TileStream::dem_;
std::unique_ptr<TileSet> TileStream::set_;

using Corners = std::array<std::array<double, 3>, 3>;

std::set<Corners> corners_of(const Tin& mesh) {
  std::set<Corners> all;
  for (const Triangle& t : mesh.triangles) {
    Corners c;
    for (int k = 0; k < 3; ++k) {
      const Vec3& v = mesh.vertices[t[k]];
      c[std::size_t(k)] = {v.x, v.y, v.z};
    }
    std::ranges::rotate(c, std::ranges::min_element(c));
    all.insert(c);
  }
  return all;
}

Tin decoded(const TileBytes& tile) {
  const auto q = proto::decode(tile.bytes);
  EXPECT_TRUE(q) << q.error().what;
  Tin mesh;
  const double low = q->min_height, range = double(q->max_height) - low;
  for (std::size_t i = 0; i < q->u.size(); ++i)
    mesh.vertices.push_back(
        {double(q->u[i]), double(q->v[i]) - kExtent, low + q->h[i] * range / kExtent});
  mesh.triangles = q->triangles;
  return mesh;
}

std::set<std::array<double, 3>> border_of(const Tin& mesh) {
  std::set<std::array<double, 3>> border;
  for (const Vec3& v : mesh.vertices)
    if (v.x == 0 || v.x == kExtent || v.y == 0 || v.y == -kExtent) border.insert({v.x, v.y, v.z});
  return border;
}

/// The largest error over all posts of the tile.
double worst_post(const DemSource& dem, TileId id, const Tin& mesh) {
  const auto posts = TilePosts::read(dem, post_window(dem, tiling::rect(id)), id, 1);
  EXPECT_TRUE(posts);
  double worst = 0;
  posts->visit([&](const auto& samples) {
    for (const Triangle& t : mesh.triangles) {
      Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
      a.y += kExtent, b.y += kExtent, c.y += kExtent;
      samples.scan(a, b, c, [&](double x, double y, double z, std::size_t) {
        const Vec3 p{x, y, 0};
        const double area = orient2d(a, b, c);
        const double mine =
            (orient2d(b, c, p) * a.z + orient2d(c, a, p) * b.z + orient2d(a, b, p) * c.z) / area;
        worst = std::max(worst, std::fabs(mine - z));
        return true;
      });
    }
  });
  return worst;
}

TEST_F(TileStream, EveryStateKeepsTheBorderAndItsError) {
  int states = 0;
  for (const int level : {6, 9, 11, set_->layer().maxzoom}) {
    const TileId id = middle(level);
    const auto tile = set_->tile(id, {});
    ASSERT_TRUE(tile) << tile.error().what;
    const auto made = tile_stream(id, tile->bytes, VerticalDatum::ellipsoid);
    ASSERT_TRUE(made) << made.error().what;
    const auto bytes = proto::encode(*made);
    ASSERT_TRUE(bytes) << bytes.error().what;
    const auto stream = proto::decode_mesh_stream(*bytes);
    ASSERT_TRUE(stream) << stream.error().what;
    ASSERT_EQ(stream->splits.size(), stream->total_splits);
    EXPECT_EQ(stream->fine_error_m, tile->max_error_m);

    const ProgressiveMesh pm = from_stream(*stream);
    auto cursor = ProgressiveCursor::open(pm);
    ASSERT_TRUE(cursor) << cursor.error().what;
    const Tin fine = decoded(*tile);
    const auto border = border_of(fine);
    const std::size_t pinned = std::size_t(curvature_cells(level) * curvature_cells(level));
    EXPECT_LE(pm.base.vertices.size(), border.size() * 7 / 6 + pinned + 12) << id.text();
    EXPECT_GE(cursor->size(), fine.vertices.size() / 2);
    double last = HUGE_VAL;
    for (int i = 0; i <= 10; ++i, ++states) {
      cursor->seek(cursor->size() * std::size_t(i) / 10);
      const Tin mesh = cursor->extract();
      const MeshValidity validity = check_validity(mesh);
      ASSERT_TRUE(validity.ok()) << validity.first_problem;
      EXPECT_EQ(validity.area, kExtent * kExtent);
      EXPECT_EQ(border_of(mesh), border) << id.text() << " state " << cursor->position();
      EXPECT_LE(cursor->error_m(), last);
      last = cursor->error_m();
      EXPECT_LE(worst_post(*dem_, id, mesh), cursor->error_m()) << id.text() << " state " << i;
    }
    EXPECT_EQ(corners_of(cursor->extract()), corners_of(fine)) << id.text();
    EXPECT_EQ(cursor->error_m(), tile->max_error_m);
  }
  EXPECT_EQ(states, 44);
}

TEST_F(TileStream, AStateIsNotFarCoarserThanItsErrorAllows) {
  const TileId id = middle(set_->layer().maxzoom - 1);
  const auto tile = set_->tile(id, {});
  ASSERT_TRUE(tile);
  const ProgressiveMesh pm = from_stream(*tile_stream(id, tile->bytes, VerticalDatum::ellipsoid));
  auto cursor = ProgressiveCursor::open(pm);
  cursor->seek(cursor->position_for_error(4 * tile->max_error_m));
  EXPECT_LT(cursor->triangles(), decoded(*tile).triangles.size() * 3 / 5);
  EXPECT_GT(worst_post(*dem_, id, cursor->extract()), tile->max_error_m);
}

TEST_F(TileStream, CoarseLevelsKeepTheirLatticeAgainstCurvature) {
  const TileId id = middle(3);
  const int cells = curvature_cells(3);
  ASSERT_GT(cells, 1);
  const auto tile = set_->tile(id, {});
  ASSERT_TRUE(tile);
  const auto stream = tile_stream(id, tile->bytes, VerticalDatum::unknown);
  ASSERT_TRUE(stream) << stream.error().what;
  std::set<std::pair<int, int>> places;
  for (const auto& p : stream->base_vertices) places.insert({p[0], p[1]});
  for (int i = 0; i <= cells; ++i)
    for (int j = 0; j <= cells; ++j)
      EXPECT_TRUE(places.contains(
          {int(std::round(i * kExtent / cells)), int(std::round(j * kExtent / cells) - kExtent)}));
}

TEST_F(TileStream, TheSameBytesEveryTime) {
  const TileId id = middle(10);
  const auto tile = set_->tile(id, {});
  ASSERT_TRUE(tile);
  const auto one = *proto::encode(*tile_stream(id, tile->bytes, VerticalDatum::egm96));
  EXPECT_EQ(one, *proto::encode(*tile_stream(id, tile->bytes, VerticalDatum::egm96)));
  // Nothing of the stream comes from normals or other extensions but the error.
  const auto bare = proto::strip_extensions(tile->bytes, {.metadata = true});
  EXPECT_EQ(one, *proto::encode(*tile_stream(id, bare, VerticalDatum::egm96)));
}

TEST(TileStreamOfOthers, HeightsOffAnyPowerOfTwoAreRoundedAndTheErrorSaysSo) {
  proto::QuantizedMesh q;
  q.u = {0, 32767, 32767, 0, 15000};
  q.v = {0, 0, 32767, 32767, 16001};
  q.h = {0, 32767, 999, 7, 31999};
  q.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  q.min_height = 12.3f, q.max_height = 1234.567f;
  q.metadata = R"({"max_error_m":3})";
  proto::arrange(q);
  const auto stream = tile_stream({9, 1, 1}, proto::encode(q), VerticalDatum::ellipsoid);
  ASSERT_TRUE(stream) << stream.error().what;
  EXPECT_GT(stream->fine_error_m, 3);
  EXPECT_LE(stream->fine_error_m, 3 + stream->z_step_m / 2);
  EXPECT_LE(stream->z_step_m, (1234.567 - 12.3) / 32767 / 8);
  EXPECT_EQ(stream->total_splits, 1u);  // one vertex may go
}

TEST(TileStreamOfOthers, TheSmallestTileIsAStreamWithoutSplits) {
  proto::QuantizedMesh q;
  q.u = {0, 32767, 32767, 0};
  q.v = {0, 0, 32767, 32767};
  q.h = {0, 0, 0, 0};
  q.triangles = {{0, 1, 2}, {0, 2, 3}};
  q.min_height = q.max_height = -11.5f;
  proto::arrange(q);
  const auto made = tile_stream({20, 7, 7}, proto::encode(q), VerticalDatum::ellipsoid);
  ASSERT_TRUE(made) << made.error().what;
  const auto stream = proto::decode_mesh_stream(*proto::encode(*made));
  ASSERT_TRUE(stream) << stream.error().what;
  EXPECT_EQ(stream->total_splits, 0u);
  EXPECT_EQ(stream->fine_error_m, 0);
  EXPECT_EQ(stream->base_triangles.size(), 2u);
  EXPECT_EQ(stream->base_vertices[0][2] * stream->z_step_m, -11.5);
  EXPECT_EQ(bytes_until(*stream, {.max_error_m = 1, .triangles = 1}), stream->base_bytes);
}

TEST(TileStreamOfOthers, VerticesWithoutATriangleAreLeftOutAndTilesWithoutOneRefused) {
  proto::QuantizedMesh q;
  q.u = {0, 32767, 32767, 0, 200, 300};
  q.v = {0, 0, 32767, 32767, 100, 900};
  q.h = {0, 0, 0, 0, 0, 0};
  q.triangles = {{0, 1, 2}, {0, 2, 3}};
  q.max_height = 1;
  const auto made = tile_stream({20, 7, 7}, proto::encode(q), VerticalDatum::ellipsoid);
  ASSERT_TRUE(made) << made.error().what;
  const auto stream = proto::decode_mesh_stream(*proto::encode(*made));
  ASSERT_TRUE(stream) << stream.error().what;
  EXPECT_EQ(stream->base_vertices.size(), 4u);
  q.triangles.clear();
  for (const std::size_t left : {6, 0}) {
    q.u.resize(left), q.v.resize(left), q.h.resize(left);
    const auto none = tile_stream({20, 7, 7}, proto::encode(q), VerticalDatum::ellipsoid);
    ASSERT_FALSE(none) << left;
    EXPECT_EQ(none.error().code, Errc::bad_data);
  }
}

TEST(TileStreamOfOthers, WhatIsNoTileIsRefusedByName) {
  const auto tile = test::MadeUpTiles().tile({3, 5, 2}, {});
  ASSERT_TRUE(tile);
  const auto whole = tile_stream({3, 5, 2}, tile->bytes, VerticalDatum::ellipsoid);
  ASSERT_TRUE(whole) << whole.error().what;
  auto cut = tile->bytes;
  cut.resize(cut.size() / 2);
  const auto refused = tile_stream({3, 5, 2}, cut, VerticalDatum::ellipsoid);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::bad_data);
  EXPECT_TRUE(refused.error().what.starts_with("tile 3/5/2: ")) << refused.error().what;

  auto q = *proto::decode(tile->bytes);
  std::swap(q.triangles[3][0], q.triangles[3][1]);
  EXPECT_FALSE(tile_stream({3, 5, 2}, proto::encode(q), VerticalDatum::ellipsoid));
}

}  // namespace
}  // namespace tind
