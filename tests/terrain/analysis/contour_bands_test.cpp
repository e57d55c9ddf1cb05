#include "terrain/analysis/contour_bands.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

#include "terrain/mesh/mesh_raster.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/raster/interpolate.h"
#include "terrain/simplify/simplify.h"

namespace tind {
namespace {

/// Hills with lakes and steps, heights in whole and half metres, so that many are just a contour's.
HeightGrid hills(int size, unsigned seed, bool voids) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0, 1);
  const double a = any(random), b = any(random), c = any(random);
  HeightGrid grid(size, size);
  for (int r = 0; r < size; ++r)
    for (int col = 0; col < size; ++col) {
      const double z = 40 * std::sin(0.31 * col + 6 * a) * std::cos(0.23 * r + 6 * b) +
                       8 * std::sin(0.9 * r * c + col) + 4 * any(random);
      grid.at(col, r) = float(std::max(-12.0, std::round(2 * z) / 2));
    }
  if (voids)
    for (int k = 0; k < size; ++k)
      grid.at(int(any(random) * size), int(any(random) * size)) = HeightGrid::kVoid;
  return grid;
}

double height_at(const HeightGrid& grid, double x, double y) {
  const int c = std::min(int(x), grid.cols() - 2), r = std::min(int(y), grid.rows() - 2);
  const auto z = [&](int dc, int dr) {
    return grid.is_void(c + dc, r + dr) ? std::nan("") : double(grid.at(c + dc, r + dr));
  };
  return height_between(z(0, 0), z(1, 0), z(0, 1), z(1, 1), x - c, y - r);
}

bool is_in_ring(const std::vector<Vec2>& ring, Vec2 p) {
  bool inside = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++)
    if ((ring[i].y > p.y) != (ring[j].y > p.y) &&
        p.x < (ring[j].x - ring[i].x) * (p.y - ring[i].y) / (ring[j].y - ring[i].y) + ring[i].x)
      inside = !inside;
  return inside;
}

/// In how many areas of the height.
int areas_around(const std::vector<ContourArea>& areas, double height, Vec2 p) {
  int count = 0;
  for (const ContourArea& area : areas) {
    if (area.height_m != height || !is_in_ring(area.rings[0], p)) continue;
    bool in_hole = false;
    for (std::size_t k = 1; k < area.rings.size(); ++k)
      in_hole = in_hole || is_in_ring(area.rings[k], p);
    count += !in_hole;
  }
  return count;
}

/// What the surface says of a place: low and high; nothing outside of all triangles.
std::optional<std::pair<double, double>> bounds_at(const BoundedSurface& surface, Vec2 p) {
  const auto& v = surface.mesh.vertices;
  for (const auto& [a, b, c] : surface.mesh.triangles) {
    const Vec3 at{p.x, -p.y, 0};
    const double all = orient2d(v[a], v[b], v[c]);
    const double wa = orient2d(v[b], v[c], at) / all, wb = orient2d(v[c], v[a], at) / all,
                 wc = orient2d(v[a], v[b], at) / all;
    if (wa < 0 || wb < 0 || wc < 0) continue;
    return std::pair(wa * surface.low[a] + wb * surface.low[b] + wc * surface.low[c],
                     wa * surface.high[a] + wb * surface.high[b] + wc * surface.high[c]);
  }
  return {};
}

std::vector<double> every(double interval) {
  std::vector<double> heights;
  for (double h = -60; h <= 60; h += interval) heights.push_back(h);
  return heights;
}

/// What a mesh is at the posts.
BoundedSurface simplified(const HeightGrid& grid, double max_error_m) {
  SimplifyOptions options;
  options.stop.max_error_m = max_error_m;
  const auto made = simplify(Terrain{grid, 1, 1}, options);
  EXPECT_TRUE(made) << made.error().what;
  MeshRaster seen = mesh_raster(made->tin, grid, 0);
  for (std::size_t i = 0; i < seen.heights.values().size(); ++i)
    if (std::isnan(seen.errors.values()[i])) seen.heights.values()[i] = HeightGrid::kVoid;
  return bounded_surface(seen.heights, vertical_error(made->tin, grid).max_m);
}

/// Where the terrain has the height, there the band is: along many lines through the cells.
void expect_contours_inside(const HeightGrid& grid, const BoundedSurface& surface,
                            const std::vector<double>& heights, unsigned seed) {
  const auto areas = contour_bands(surface, heights);
  ASSERT_TRUE(areas);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0, grid.cols() - 1);
  std::uniform_int_distribution<std::size_t> which(0, heights.size() - 1);
  int found = 0;
  for (int i = 0; i < 20'000 && found < 2000; ++i) {
    const Vec2 from{any(random), any(random)};
    const Vec2 to{from.x + any(random) / 20 - 1, from.y + any(random) / 20 - 1};
    if (to.x < 0 || to.y < 0 || to.x > grid.cols() - 1 || to.y > grid.rows() - 1) continue;
    const double c = heights[which(random)];
    const auto at = [&](double t) {
      return Vec2{from.x + t * (to.x - from.x), from.y + t * (to.y - from.y)};
    };
    double low = 0, high = 1;
    const auto above = [&](double t) { return height_at(grid, at(t).x, at(t).y) - c; };
    if (!(above(0) * above(1) < 0)) continue;
    for (int step = 0; step < 60; ++step) {
      const double middle = (low + high) / 2;
      (above(low) * above(middle) <= 0 ? high : low) = middle;
    }
    if (!(std::abs(above(low)) < 1e-6)) continue;  // a void between
    if (!bounds_at(surface, at(low))) continue;    // the mesh is not there
    ++found;
    EXPECT_EQ(areas_around(*areas, c, at(low)), 1)
        << "height " << c << " at " << at(low).x << ", " << at(low).y;
  }
  EXPECT_GT(found, 200);
}

TEST(ContourBands, AContourOfTheDemIsInThatOfItsMesh) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const HeightGrid grid = hills(48, seed, seed % 2 == 0);
    for (const double error : {0.01, 1.0, 6.0})
      expect_contours_inside(grid, simplified(grid, error), every(2.5), seed);
  }
}

TEST(ContourBands, AContourOfTheDemIsInThatOfPostsThatAreOff) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const HeightGrid grid = hills(48, seed, seed % 2 == 0);
    HeightGrid seen = grid;
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> off(-3, 3);
    for (float& z : seen.values()) z += off(random);
    expect_contours_inside(grid, bounded_surface(seen, 3), every(2.5), seed);
  }
}

TEST(ContourBands, IsWhereTheHeightLiesBetweenBothSurfacesAndNowhereElse) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(0, 29);
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const HeightGrid grid = hills(30, seed, seed % 2 == 0);
    for (const BoundedSurface& surface : {simplified(grid, 4), bounded_surface(grid, 0.75)}) {
      const auto heights = every(5);
      const auto areas = contour_bands(surface, heights);
      ASSERT_TRUE(areas);
      for (int i = 0; i < 3000; ++i) {
        const Vec2 p{any(random), any(random)};
        const auto bounds = bounds_at(surface, p);
        for (const double c : heights) {
          if (bounds && (std::abs(bounds->first - c) < 1e-9 || std::abs(bounds->second - c) < 1e-9))
            continue;
          const bool between = bounds && bounds->first <= c && c <= bounds->second;
          ASSERT_EQ(areas_around(*areas, c, p), between ? 1 : 0)
              << c << " at " << p.x << ", " << p.y;
        }
      }
    }
  }
}

TEST(ContourBands, ARingAroundAHillHasOneHole) {
  HeightGrid grid(41, 41);
  for (int r = 0; r < 41; ++r)
    for (int c = 0; c < 41; ++c)
      grid.at(c, r) = float(std::max(0.0, 100 - 5 * std::hypot(c - 20, r - 20)));
  const double heights[] = {50, 200, 100};
  const auto areas = contour_bands(bounded_surface(grid, 5), heights);
  ASSERT_TRUE(areas);
  ASSERT_EQ(areas->size(), 2u);
  EXPECT_EQ((*areas)[0].height_m, 50);
  ASSERT_EQ((*areas)[0].rings.size(), 2u);
  for (const Vec2& p : (*areas)[0].rings[0]) EXPECT_NEAR(std::hypot(p.x - 20, p.y - 20), 11, 0.2);
  for (const Vec2& p : (*areas)[0].rings[1]) EXPECT_NEAR(std::hypot(p.x - 20, p.y - 20), 9, 0.2);
  EXPECT_EQ((*areas)[1].height_m, 100);
  EXPECT_EQ((*areas)[1].rings.size(), 1u);
}

TEST(ContourBands, AllOfALevelPlaneMayHaveItsHeight) {
  HeightGrid grid(9, 5);
  for (float& z : grid.values()) z = 12;
  for (const double height : {11.0, 12.0, 13.0}) {
    const auto areas = contour_bands(bounded_surface(grid, 1), std::span(&height, 1));
    ASSERT_TRUE(areas);
    ASSERT_EQ(areas->size(), 1u) << height;
    EXPECT_EQ((*areas)[0].rings.size(), 1u);
    EXPECT_EQ(areas_around(*areas, height, {4.5, 2.5}), 1);
  }
}

}  // namespace
}  // namespace tind
