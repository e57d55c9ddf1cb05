#include "terrain/analysis/volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>

#include "terrain/analysis/zonal.h"
#include "terrain/raster/interpolate.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::MadeUpSource;

MadeUpSource dem_of(HeightGrid grid) { return MadeUpSource(std::move(grid), {10, 50}, 0.001); }

/// A star of `points` corners, not convex.
std::vector<Vec2> star(std::mt19937& random, Vec2 middle, double size, int points) {
  std::uniform_real_distribution<double> share(0.3, 1);
  std::vector<Vec2> ring;
  for (int i = 0; i < points; ++i) {
    const double angle = 2 * M_PI * i / points, r = size * share(random);
    ring.push_back({middle.x + r * std::cos(angle), middle.y + r * std::sin(angle)});
  }
  return ring;
}

bool inside(const PostRings& rings, Vec2 p) {
  bool odd = false;
  for (const auto& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vec2 &a = ring[i], &b = ring[(i + 1) % ring.size()];
      if ((a.y <= p.y) != (b.y <= p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y))
        odd = !odd;
    }
  return odd;
}

/// By a fine raster of samples.
AreaIntegral sampled(const MadeUpSource& dem, const PostRings& area, double height, int per_post) {
  const GroundArea ground(dem.info());
  const HeightGrid& g = dem.grid();
  AreaIntegral out;
  const double step = 1.0 / per_post;
  for (int j = 0; j < (g.rows() - 1) * per_post; ++j)
    for (int i = 0; i < (g.cols() - 1) * per_post; ++i) {
      const Vec2 p{(i + 0.5) * step, (j + 0.5) * step};
      if (!inside(area, p)) continue;
      const int c = int(p.x), r = int(p.y);
      const double z = height_between(g.at(c, r), g.at(c + 1, r), g.at(c, r + 1),
                                      g.at(c + 1, r + 1), p.x - c, p.y - r);
      const double m2 = ground.at(p.x, p.y) * step * step;
      if (std::isnan(z)) {
        out.void_area_m2 += m2;
        continue;
      }
      out.area_m2 += m2;
      out.above_m3 += m2 * std::max(z - height, 0.0);
      out.below_m3 += m2 * std::max(height - z, 0.0);
    }
  return out;
}

TEST(Volume, OfStarsWithHolesAndVoidsIsWhatFineSamplesSay) {
  std::mt19937 random(4);
  for (int round = 0; round < 12; ++round) {
    const MadeUpSource dem =
        dem_of(round % 2 ? test::terrain_with_voids(16, 14, unsigned(round), 40)
                         : test::rough_terrain(16, 14, unsigned(round), 40));
    PostRings area = {star(random, {7.5, 6.5}, 7, 9)};
    if (round % 3 == 0) area.push_back(star(random, {7.5, 6.5}, 2, 5));  // a hole
    if (round % 4 == 0)
      for (auto& ring : area)
        for (Vec2& p : ring) p = {std::round(p.x), std::round(p.y)};  // edges through posts
    const auto found = volume(dem, LevelReference{20}, area);
    ASSERT_TRUE(found) << found.error().what;
    const AreaIntegral truth = sampled(dem, area, 20, 60);
    const double all = truth.area_m2 + truth.void_area_m2;
    ASSERT_NEAR(found->area_m2, truth.area_m2, 2e-3 * all) << round;
    ASSERT_NEAR(found->void_area_m2, truth.void_area_m2, 2e-3 * all) << round;
    ASSERT_NEAR(found->cut_m3.value, truth.above_m3, 3e-2 * all) << round;
    ASSERT_NEAR(found->fill_m3.value, truth.below_m3, 3e-2 * all) << round;
  }
}

/// Edges along rows, between them: what is turned by a hair has none.
TEST(Volume, OfRectanglesAndStairsIsThatOfThemTurnedByAHair) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> x(0.2, 14.8), y(0.2, 12.8);
  const auto turned = [](PostRings rings) {
    for (auto& ring : rings)
      for (Vec2& p : ring) p.y += 1e-9 * p.x;
    return rings;
  };
  for (int round = 0; round < 40; ++round) {
    const MadeUpSource dem =
        dem_of(round % 2 ? test::terrain_with_voids(16, 14, unsigned(round), 40)
                         : test::rough_terrain(16, 14, unsigned(round), 40));
    double west = x(random), east = x(random), north = y(random), south = y(random);
    if (west > east) std::swap(west, east);
    if (north > south) std::swap(north, south);
    const double mid_x = (2 * west + east) / 3, mid_y = (north + 2 * south) / 3;
    PostRings area = {{{west, north}, {east, north}, {east, south}, {west, south}}};
    if (round % 4 == 1)  // within one row of cells
      for (Vec2& p : area[0]) p.y = std::floor(north) + (p.y == north ? 0.3 : 0.6);
    if (round % 4 == 2)
      area[0] = {{west, north}, {mid_x, north}, {mid_x, mid_y},
                 {east, mid_y}, {east, south},  {west, south}};
    if (round % 4 == 3)  // a hole, too
      area.push_back({{(west + mid_x) / 2, (north + mid_y) / 2},
                      {mid_x, (north + mid_y) / 2},
                      {mid_x, mid_y},
                      {(west + mid_x) / 2, mid_y}});
    const auto found = volume(dem, LevelReference{20}, area),
               near = volume(dem, LevelReference{20}, turned(area));
    ASSERT_TRUE(found && near);
    const AreaIntegral truth = sampled(dem, area, 20, 40);
    const double rim = 2 * (east - west + south - north) * GroundArea(dem.info()).at(7, 6) / 40;
    ASSERT_NEAR(found->area_m2, truth.area_m2, rim) << round;
    const double little = 1e-6 * (found->area_m2 + found->void_area_m2);
    ASSERT_NEAR(found->area_m2, near->area_m2, little) << round;
    ASSERT_NEAR(found->void_area_m2, near->void_area_m2, little) << round;
    ASSERT_NEAR(found->cut_m3.value, near->cut_m3.value, 100 * little) << round;
    ASSERT_NEAR(found->fill_m3.value, near->fill_m3.value, 100 * little) << round;
  }
}

/// A ring that crosses itself is inside where it goes around an odd number of times.
TEST(Volume, OfRingsThatCrossThemselvesInOneCell) {
  HeightGrid grid(6, 6, 10);
  const MadeUpSource dem(std::move(grid), {10, 0.0025}, 0.001);
  const auto shoelace = [](const std::vector<Vec2>& ring) {
    double sum = 0;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vec2 &a = ring[i], &b = ring[(i + 1) % ring.size()];
      sum += a.x * b.y - b.x * a.y;
    }
    return std::abs(sum) / 2;
  };
  const double m2 = GroundArea(dem.info()).at(2, 2.5);
  // Two triangles that meet at the crossing (2.5, 2.5625), and (2.25, 2.28...).
  const auto bow = volume(dem, LevelReference{0}, {{{2, 2}, {3, 2}, {2.2, 2.9}, {2.8, 2.9}}});
  ASSERT_TRUE(bow);
  const double y = 2 + 0.9 * 0.625;
  EXPECT_NEAR(
      bow->area_m2,
      m2 * (shoelace({{2, 2}, {3, 2}, {2.5, y}}) + shoelace({{2.5, y}, {2.2, 2.9}, {2.8, 2.9}})),
      1e-5 * m2);
  EXPECT_NEAR(bow->cut_m3.value, 10 * bow->area_m2, 1e-6 * m2);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> at(1.1, 3.9);
  for (int round = 0; round < 30; ++round) {
    PostRings area(1);
    for (int k = 0; k < 7; ++k) area[0].push_back({at(random), at(random)});
    const auto found = volume(dem, LevelReference{0}, area);
    ASSERT_TRUE(found);
    const AreaIntegral truth = sampled(dem, area, 0, 150);
    ASSERT_NEAR(found->area_m2, truth.area_m2, 3e-3 * 8 * m2) << round;
  }
}

/// Polygons that share an edge, but for rounding, far from the first post: rounding makes crossings
/// without number of that.
TEST(Volume, OfRingsThatNearlyShareAnEdge) {
  HeightGrid grid(6, 20006, 10);
  const MadeUpSource dem(std::move(grid), {10, 1}, 1e-4);
  const double top = 20000.1, bottom = 20004.7;
  PostRings area = {{{1.1, top}, {2.3, top}, {2.9, bottom}, {1.2, bottom}}, {}};
  for (int k = 0; k <= 40; ++k) {  // the same edge, in pieces
    const double t = k / 40.0;
    area[1].push_back({2.3 + t * (2.9 - 2.3), top + t * (bottom - top)});
  }
  area[1].push_back({4.4, bottom}), area[1].push_back({4.1, top});
  const auto found = volume(dem, LevelReference{0}, area),
             hull = volume(dem, LevelReference{0},
                           {{{1.1, top}, {4.1, top}, {4.4, bottom}, {1.2, bottom}}});
  ASSERT_TRUE(found && hull);
  EXPECT_NEAR(found->area_m2 / hull->area_m2, 1, 1e-8);
}

/// Latitudes that change along columns.
TEST(Volume, OfATransposedDemIsThatOfTheSameUpright) {
  const test::TempDir dir;
  const auto dem = [&](const std::string& name, bool transposed) {
    const int cols = transposed ? 41 : 11, rows = transposed ? 11 : 41;
    std::ofstream bytes(dir.file(name + ".raw"), std::ios::binary);
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < cols; ++c) {
        const float z = float(10 * (transposed ? r : c) + (transposed ? c : r));
        bytes.write(reinterpret_cast<const char*>(&z), sizeof z);
      }
    std::ofstream(dir.file(name + ".vrt"))
        << "<VRTDataset rasterXSize=\"" << cols << "\" rasterYSize=\"" << rows
        << "\"><SRS>EPSG:4326</SRS><GeoTransform>"
        << (transposed ? "10, 0, 1, 80, -1, 0" : "10, 1, 0, 80, 0, -1")
        << "</GeoTransform><VRTRasterBand dataType=\"Float32\" band=\"1\" "
           "subClass=\"VRTRawRasterBand\"><SourceFilename relativeToVRT=\"1\">"
        << name << ".raw</SourceFilename></VRTRasterBand></VRTDataset>";
    bytes.close();
    DemOptions options;
    options.allow_vrt = true;
    auto opened = DemSource::open(std::vector{dir.file(name + ".vrt")}, options);
    if (!opened) throw std::runtime_error(opened.error().what);
    return *opened;
  };
  const auto turned = dem("turned", true), upright = dem("upright", false);
  const auto a = volume(*turned, LevelReference{5}, whole_area(turned->info())),
             b = volume(*upright, LevelReference{5}, whole_area(upright->info()));
  ASSERT_TRUE(a && b);
  EXPECT_NEAR(a->area_m2 / b->area_m2, 1, 1e-4);  // cells go along the other side
  EXPECT_NEAR(a->cut_m3.value / b->cut_m3.value, 1, 1e-4);
}

TEST(Volume, IsExactWhereAFormulaSaysWhatItIs) {
  // x y over a square of side 2 around 0 in one cell: half of it positive, 1/4 of the side^4 / 4.
  HeightGrid grid(2, 2);
  grid.at(0, 0) = 1, grid.at(1, 0) = -1, grid.at(0, 1) = -1, grid.at(1, 1) = 1;
  const MadeUpSource dem(grid, {10, 0.0005}, 0.001);  // at the equator a row is as the next
  const auto saddle = volume(dem, LevelReference{0}, whole_area(dem.info()));
  ASSERT_TRUE(saddle);
  const double m2 = GroundArea(dem.info()).at(0.5, 0.5);
  EXPECT_NEAR(saddle->area_m2, m2, 1e-9 * m2);
  EXPECT_NEAR(saddle->cut_m3.value, m2 / 8, 1e-9 * m2);
  EXPECT_NEAR(saddle->fill_m3.value, m2 / 8, 1e-9 * m2);
  EXPECT_NEAR(saddle->net_m3.value, 0, 1e-9 * m2);
  // A wedge cut by a slanting height.
  HeightGrid slope(2, 2);
  slope.at(0, 0) = slope.at(0, 1) = -1, slope.at(1, 0) = slope.at(1, 1) = 3;
  const MadeUpSource wedge(slope, {10, 0.0005}, 0.001);
  const auto halves = volume(wedge, LevelReference{0}, whole_area(wedge.info()), 0.5);
  ASSERT_TRUE(halves);
  EXPECT_NEAR(halves->cut_m3.value, m2 * 9 / 8, 1e-9 * m2);
  EXPECT_NEAR(halves->fill_m3.value, m2 * 1 / 8, 1e-9 * m2);
  EXPECT_NEAR(halves->cut_m3.low, m2 * 2.5 * 2.5 / 8, 1e-9 * m2);
  EXPECT_NEAR(halves->cut_m3.high, m2 * 3.5 * 3.5 / 8, 1e-9 * m2);
  EXPECT_NEAR(halves->net_m3.low, m2 * 0.5, 1e-9 * m2);
}

TEST(Volume, AreasOfAPartitionAddUp) {
  std::mt19937 random(8);
  const MadeUpSource dem = dem_of(test::terrain_with_voids(30, 30, 2, 100));
  const auto all = volume(dem, LevelReference{50}, whole_area(dem.info()));
  ASSERT_TRUE(all);
  PostRings rest = whole_area(dem.info());
  const PostRings part = {star(random, {14, 15}, 13, 12)};
  rest.push_back(part[0]);
  const auto a = volume(dem, LevelReference{50}, part), b = volume(dem, LevelReference{50}, rest);
  ASSERT_TRUE(a && b);
  EXPECT_NEAR(a->area_m2 + b->area_m2, all->area_m2, 1e-9 * all->area_m2);
  EXPECT_NEAR(a->void_area_m2 + b->void_area_m2, all->void_area_m2, 1e-9 * all->area_m2);
  EXPECT_NEAR(a->cut_m3.value + b->cut_m3.value, all->cut_m3.value, 1e-9 * all->cut_m3.value);
  EXPECT_NEAR(a->fill_m3.value + b->fill_m3.value, all->fill_m3.value, 1e-9 * all->fill_m3.value);
  EXPECT_FALSE(all->beyond);
  const PostRings far = {star(random, {14, 15}, 40, 12)};
  EXPECT_TRUE(volume(dem, LevelReference{50}, far)->beyond);
}

TEST(Volume, AnIntervalHoldsTheTruth) {
  std::mt19937 random(3);
  for (const double e : {0.1, 2.0, 30.0})
    for (unsigned world = 0; world < 20; ++world) {
      const HeightGrid truth = test::terrain_with_voids(24, 20, world, 60);
      HeightGrid seen = truth;
      std::uniform_real_distribution<double> error(-e, e);
      for (float& z : seen.values()) z = float(z + 0.999 * (world % 2 ? e : error(random)));
      const PostRings area = {star(random, {12, 10}, 11, 9)};
      const MadeUpSource real = dem_of(truth), asked = dem_of(seen);
      const auto told = volume(asked, LevelReference{30}, area, e);
      const auto is = volume(real, LevelReference{30}, area);
      ASSERT_TRUE(told && is);
      for (const auto which : {&Volume::cut_m3, &Volume::fill_m3, &Volume::net_m3}) {
        const Within within = (*told).*which;
        const double value = ((*is).*which).value;
        ASSERT_LE(within.low, value) << e << " " << world;
        ASSERT_GE(within.high, value) << e << " " << world;
        ASSERT_LE(within.low, within.value);
        ASSERT_GE(within.high, within.value);
      }
    }
}

TEST(Volume, AgainstAPlaneAndAgainstADem) {
  HeightGrid grid(9, 7), flat(9, 7, 10);
  for (int r = 0; r < 7; ++r)
    for (int c = 0; c < 9; ++c) grid.at(c, r) = float(100 + 2 * c - 3 * r);
  const MadeUpSource dem = dem_of(grid);
  const PlaneReference plane{{{{0, 0, 99}, {8, 0, 115}, {0, 6, 81}}}};
  const auto above = volume(dem, plane, whole_area(dem.info()));
  ASSERT_TRUE(above) << above.error().what;
  EXPECT_NEAR(above->cut_m3.value, above->area_m2, 1e-6 * above->area_m2);
  EXPECT_NEAR(above->fill_m3.value, 0, 1e-6 * above->area_m2);
  const PlaneReference line{{{{0, 0, 1}, {1, 1, 2}, {2, 2, 3}}}};
  EXPECT_EQ(volume(dem, line, whole_area(dem.info())).error().code, Errc::invalid_argument);
  const auto other = std::make_shared<const MadeUpSource>(flat, Geographic{10, 50}, 0.001);
  const auto less = volume(dem, DemReference{other}, whole_area(dem.info()));
  const auto level = volume(dem, LevelReference{10}, whole_area(dem.info()));
  ASSERT_TRUE(less && level);
  EXPECT_NEAR(less->cut_m3.value, level->cut_m3.value, 1e-9 * level->cut_m3.value);
}

TEST(ZonalStatistics, AreThoseOfThePostsInside) {
  std::mt19937 random(6);
  const auto dem = std::make_shared<const MadeUpSource>(test::terrain_with_voids(40, 36, 5),
                                                        Geographic{10, 50}, 0.001);
  std::size_t voids = 0;
  for (int round = 0; round < 20; ++round) {
    const PostRings area = {star(random, {20, 18}, 5 + round, 8)};
    const auto found = zonal_statistics(dem, area, 100);
    ASSERT_TRUE(found) << found.error().what;
    std::vector<double> z;
    std::size_t without = 0;
    for (int r = 0; r < 36; ++r)
      for (int c = 0; c < 40; ++c) {
        if (!inside(area, {double(c), double(r)})) continue;
        if (dem->grid().is_void(c, r))
          ++without;
        else
          z.push_back(dem->grid().at(c, r));
      }
    ASSERT_EQ(found->posts, z.size());
    ASSERT_EQ(found->voids, without);
    voids += without;
    std::ranges::sort(z);
    double sum = 0, squares = 0;
    for (const double v : z) sum += v, squares += v * v;
    const double n = double(z.size()), mean = sum / n;
    EXPECT_EQ(found->min_m, z.front());
    EXPECT_EQ(found->max_m, z.back());
    EXPECT_NEAR(found->mean_m, mean, 1e-9);
    EXPECT_NEAR(found->std_m, std::sqrt(squares / n - mean * mean), 1e-6);
    EXPECT_NEAR(found->median_m, (z[(z.size() - 1) / 2] + z[z.size() / 2]) / 2, 1e-9);
    const auto whole = volume(*dem, LevelReference{100}, area);
    ASSERT_TRUE(whole);
    EXPECT_NEAR(found->volume_m3, whole->net_m3.value, 1e-6 * (1 + std::abs(found->volume_m3)));
    EXPECT_NEAR(found->area_m2, whole->area_m2, 1e-9 * whole->area_m2);
  }
  EXPECT_GT(voids, 0u);
  const auto nowhere = zonal_statistics(dem, {{{100, 100}, {110, 100}, {100, 110}}});
  ASSERT_TRUE(nowhere);
  EXPECT_EQ(nowhere->posts, 0u);
  EXPECT_TRUE(nowhere->beyond);
}

/// Whichever way rows and columns are stored, and rings run.
TEST(ZonalStatistics, PostsOnEdgesCountToTheEastAndTheSouthOfTheMap) {
  const PostRings box = {{{2, 2}, {6, 2}, {6, 6}, {2, 6}}};
  const auto statistics = [&](double x_col, double y_row) {
    const test::TempDir dir;
    std::ofstream raw(dir.file("z.raw"), std::ios::binary);
    for (int r = 0; r < 9; ++r)
      for (int c = 0; c < 9; ++c) {
        const int east = x_col > 0 ? c : 8 - c, south = y_row < 0 ? r : 8 - r;
        const float z = float(east * east + 100 * south);
        raw.write(reinterpret_cast<const char*>(&z), sizeof z);
      }
    raw.close();
    std::ofstream(dir.file("z.vrt"))
        << "<VRTDataset rasterXSize=\"9\" rasterYSize=\"9\"><SRS>EPSG:32632</SRS><GeoTransform>"
        << (x_col > 0 ? 500000 : 500090) << "," << x_col << ",0," << (y_row < 0 ? 5000090 : 5000000)
        << ",0," << y_row
        << "</GeoTransform><VRTRasterBand dataType=\"Float32\" band=\"1\" "
           "subClass=\"VRTRawRasterBand\"><SourceFilename relativeToVRT=\"1\">z.raw"
           "</SourceFilename></VRTRasterBand></VRTDataset>";
    DemOptions options;
    options.allow_vrt = true;
    auto opened = DemSource::open(std::vector{dir.file("z.vrt")}, options);
    if (!opened) throw std::runtime_error(opened.error().what);
    return *zonal_statistics(*opened, box);  // the same box of the map: it is in the middle
  };
  const ZonalStatistics wanted = statistics(10, -10);
  EXPECT_EQ(wanted.posts, 16u);
  EXPECT_EQ(wanted.min_m, 204);
  EXPECT_EQ(wanted.max_m, 525);
  for (const auto& [x_col, y_row] : {std::pair(-10., -10.), {10., 10.}, {-10., 10.}}) {
    const ZonalStatistics found = statistics(x_col, y_row);
    EXPECT_EQ(found.posts, 16u);
    EXPECT_EQ(found.mean_m, wanted.mean_m) << x_col << " " << y_row;
    EXPECT_EQ(std::pair(found.min_m, found.max_m), std::pair(wanted.min_m, wanted.max_m));
  }
}

TEST(ZonalStatistics, PolygonsSideBySideShareNoPost) {
  const auto shared =
      std::make_shared<MadeUpSource>(test::rough_terrain(60, 14, 3, 40), Geographic{10, 50}, 0.001);
  std::mt19937 random(5);
  for (int round = 0; round < 300; ++round) {
    const Vec2 a{double(1 + random() % 58), 1}, b{double(1 + random() % 58), 12};
    const PostRings west = {{{0.5, 1}, a, b, {0.5, 12}}}, east = {{{59, 1}, {59, 12}, b, a}},
                    all = {{{0.5, 1}, {59, 1}, {59, 12}, {0.5, 12}}};
    ASSERT_EQ(zonal_statistics(shared, west)->posts + zonal_statistics(shared, east)->posts,
              zonal_statistics(shared, all)->posts)
        << a.x << " " << b.x;
  }
}

}  // namespace
}  // namespace tind
