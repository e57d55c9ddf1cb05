#include "terrain/tile/culling.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "terrain/geo/ellipsoid.h"
#include "terrain/geo/tiling_scheme.h"

namespace tind {
namespace {

/// A grid of vertices over a tile with heights low..high, each end reached.
std::vector<Vec3> tile_vertices(const GeoRect& r, double low, double high, std::mt19937& random,
                                int cells = 8) {
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Vec3> vertices;
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x)
      vertices.push_back({r.west + r.width() * x / cells, r.south + r.height() * y / cells,
                          low + (high - low) * share(random)});
  vertices[random() % vertices.size()].z = low;
  vertices[random() % vertices.size()].z = high;
  return vertices;
}

/// Brute force: does the segment camera-vertex (scaled space) stay outside the sphere of radius r?
/// A hair of the radius is left to the vertices that lie exactly on it.
bool can_see(const Vec3& camera, const Vec3& vertex, double r) {
  const Vec3 d = vertex - camera;
  const double t = std::clamp(-dot(camera, d) / dot(d, d), 0.0, 1.0);
  return length(camera + d * t) > r * (1 + 1e-13);
}

/// Cameras from 1 cm above the surface to beyond the moon, many of them near this tile's horizon.
Vec3 random_camera(const GeoRect& rect, std::mt19937& random) {
  std::uniform_real_distribution<double> share(0, 1);
  const double height = share(random) < 0.1 ? 0.01 : std::pow(10.0, share(random) * 8);
  const double horizon = std::acos(1 / (1 + height / 6378137)) * 57.29577951308232;
  const double away = horizon * (0.7 + share(random)) + (rect.width() + 3) * share(random);
  const double turn = 6.283185307179586 * share(random);
  double lat = (rect.south + rect.north) / 2 + away * std::sin(turn);
  double lon = (rect.west + rect.east) / 2 +
               away * std::cos(turn) / std::max(0.05, std::cos(lat * 0.017453292519943295));
  if (lat > 90) lat = 180 - lat, lon += 180;
  if (lat < -90) lat = -180 - lat, lon += 180;
  return ellipsoid_scaled(wgs84::to_ecef({lon, lat}, height));
}

struct HeightRange {
  double low, high;
};
constexpr HeightRange kRanges[] = {{0, 0},         {0, 4000},       {-430, -400},
                                   {-10900, 8800}, {-11000, -9000}, {8000, 8848}};

std::vector<TileId> tiles(std::mt19937& random) {
  std::vector<TileId> all;
  for (int level = 0; level <= 2; ++level)
    for (std::uint32_t x = 0; x < tiling::columns(level); ++x)
      for (std::uint32_t y = 0; y < tiling::rows(level); ++y) all.push_back({level, x, y});
  for (int level = 3; level <= 16; ++level) {
    const std::uint32_t columns = tiling::columns(level), rows = tiling::rows(level);
    for (const std::uint32_t y : {0u, rows - 1, rows / 2, std::uint32_t(random() % rows)})
      for (const std::uint32_t x : {0u, columns - 1, std::uint32_t(random() % columns)})
        all.push_back({level, x, y});
  }
  return all;
}

TEST(Culling, WhatTheOcclusionPointHidesCannotBeSeen) {
  std::mt19937 random(7);
  int hidden = 0, shown = 0;
  for (const TileId tile : tiles(random)) {
    const GeoRect rect = tiling::rect(tile);
    for (const auto [low, high] : kRanges) {
      const auto vertices = tile_vertices(rect, low, high, random, tile.level < 3 ? 16 : 4);
      const CullingVolumes volumes = culling_volumes(rect, vertices);
      std::vector<Vec3> scaled;
      double r = 1;
      for (const Vec3& p : vertices) {
        scaled.push_back(ellipsoid_scaled(wgs84::to_ecef({p.x, p.y}, p.z)));
        r = std::min(r, length(scaled.back()));
      }
      for (int i = 0; i < 60; ++i) {
        const Vec3 camera = random_camera(rect, random);
        if (!hidden_by_horizon(volumes.horizon_occlusion, camera)) {
          ++shown;
          continue;
        }
        ++hidden;
        for (const Vec3& p : scaled)
          ASSERT_FALSE(can_see(camera, p, r)) << tile.text() << " " << low << ".." << high;
      }
    }
  }
  EXPECT_GT(hidden, 3000);  // the point is not merely always visible
  EXPECT_GT(shown, 3000);
}

TEST(Culling, OcclusionPointIsRingsFormulaWhereHeightsArePositive) {
  std::mt19937 random(3);
  for (const TileId tile : {TileId{3, 5, 2}, TileId{9, 327, 380}, TileId{14, 4000, 12000}}) {
    const GeoRect rect = tiling::rect(tile);
    const auto vertices = tile_vertices(rect, 10, 3000, random);
    const CullingVolumes volumes = culling_volumes(rect, vertices);
    const Vec3 center = ellipsoid_scaled(volumes.center);
    const Vec3 direction = center * (1 / length(center));
    double k = 0;
    for (const Vec3& v : vertices) {
      const Vec3 p = ellipsoid_scaled(wgs84::to_ecef({v.x, v.y}, v.z));
      const double angle = std::atan2(length(cross(p, direction)), dot(p, direction));
      k = std::max(k, 1 / std::cos(angle + std::acos(1 / std::max(1.0, length(p)))));
    }
    EXPECT_NEAR(length(volumes.horizon_occlusion), k, 1e-10 * k) << tile.text();
    EXPECT_NEAR(length(cross(volumes.horizon_occlusion, direction)), 0, 1e-12);
  }
}

TEST(Culling, HemispheresHaveAFinitePointThatIsNeverHidden) {
  std::mt19937 random(5);
  for (const std::uint32_t x : {0u, 1u}) {
    const GeoRect rect = tiling::rect({0, x, 0});
    const CullingVolumes volumes = culling_volumes(rect, tile_vertices(rect, -100, 5000, random));
    const Vec3 p = volumes.horizon_occlusion;
    EXPECT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
    EXPECT_EQ(p.y > 0, x == 1);
    for (int i = 0; i < 1000; ++i) EXPECT_FALSE(hidden_by_horizon(p, random_camera(rect, random)));
  }
}

TEST(Culling, SphereHoldsEveryVertexAndIsNotFarTooLarge) {
  std::mt19937 random(11);
  for (const TileId tile : tiles(random)) {
    const GeoRect rect = tiling::rect(tile);
    for (const auto [low, high] : kRanges) {
      const auto vertices = tile_vertices(rect, low, high, random);
      const CullingVolumes volumes = culling_volumes(rect, vertices);
      double spread = 0;  // no sphere can be smaller than half of this
      const Vec3 first = wgs84::to_ecef({vertices[0].x, vertices[0].y}, vertices[0].z);
      for (const Vec3& v : vertices) {
        const Vec3 p = wgs84::to_ecef({v.x, v.y}, v.z);
        ASSERT_LE(length(p - volumes.sphere_center), volumes.sphere_radius) << tile.text();
        spread = std::max(spread, length(p - first));
      }
      EXPECT_LE(volumes.sphere_radius, 1.3 * spread + 1) << tile.text();
    }
  }
}

TEST(Culling, OneVertexIsEnough) {
  const CullingVolumes volumes = culling_volumes({10, 20, 11, 21}, std::vector<Vec3>{{10, 20, 5}});
  EXPECT_NEAR(volumes.sphere_radius, 0, 0.25);  // volumes stand on steps of 1/8 m
  EXPECT_GE(length(volumes.horizon_occlusion), 1);
}

}  // namespace
}  // namespace tind
