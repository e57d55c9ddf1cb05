#include "terrain/analysis/derivatives.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "tests/support/made_up_source.h"
#include "tests/support/support.h"
#include "tests/support/text_dem.h"

namespace tind {
namespace {

using test::MadeUpSource;

HeightGrid all_of(const DemSource& dem, const DerivativeOptions& options) {
  auto rows = derivative_rows(dem, options)(0, int(dem.info().rows));
  EXPECT_TRUE(rows) << rows.error().what;
  return *rows;
}

/// Posts 10 m apart on a plane that rises `east` and `north` a metre.
std::shared_ptr<const DemSource> plane(const test::TempDir& dir, double east, double north) {
  const std::string file = dir.file("plane.asc");
  {
    std::ofstream out(file);
    out << "ncols 7\nnrows 5\nxllcorner 500000\nyllcorner 5000000\ncellsize 10\nNODATA_value -9\n";
    for (int r = 0; r < 5; ++r)
      for (int c = 0; c < 7; ++c)
        out << (r == 2 && c == 5 ? -9 : 1000 + 10 * c * east - 10 * r * north)
            << (c == 6 ? '\n' : ' ');
  }
  const auto dem = DemSource::open({&file, 1}, {.crs = "EPSG:32632"});
  EXPECT_TRUE(dem) << dem.error().what;
  return *dem;
}

TEST(Derivatives, OfAPlaneAreThePlanesUpToItsRimAndItsVoids) {
  const test::TempDir dir;
  const auto dem = plane(dir, 0.5, -0.25);  // up to the east and to the south
  const HeightGrid slope = all_of(*dem, {.kind = Derivative::slope});
  const HeightGrid percent = all_of(*dem, {.kind = Derivative::slope, .percent = true});
  const HeightGrid aspect = all_of(*dem, {.kind = Derivative::aspect});
  const double rise = std::hypot(0.5, 0.25);
  const double facing = std::atan2(-0.5, 0.25) * 180 / M_PI + 360;  // west-north-west
  for (int r = 0; r < 5; ++r)
    for (int c = 0; c < 7; ++c) {
      if (r == 2 && c == 5) {
        EXPECT_TRUE(slope.is_void(c, r));
        continue;
      }
      EXPECT_NEAR(slope.at(c, r), std::atan(rise) * 180 / M_PI, 1e-4) << c << " " << r;
      EXPECT_NEAR(percent.at(c, r), 100 * rise, 1e-3);
      EXPECT_NEAR(aspect.at(c, r), facing, 1e-4) << c << " " << r;
    }
}

/// Up by 0.5 a metre of x and by 0.25 a metre of y, in a projection.
std::shared_ptr<const DemSource> slanted(const test::TempDir& dir, const std::string& crs, double x,
                                         double y) {
  const std::string file = dir.file("slanted.asc");
  std::ofstream out(file);
  out << "ncols 5\nnrows 5\nxllcorner " << x << "\nyllcorner " << y << "\ncellsize 10\n";
  for (int r = 0; r < 5; ++r)
    for (int c = 0; c < 5; ++c) out << 1000 + 5 * c - 2.5 * r << (c == 4 ? '\n' : ' ');
  out.close();
  const auto dem = DemSource::open({&file, 1}, {.crs = crs});
  EXPECT_TRUE(dem) << crs << ": " << dem.error().what;
  return *dem;
}

TEST(Derivatives, FaceTheNorthOfTheGridWhicheverWayTheAxesCount) {
  const test::TempDir dir;
  struct Row {
    const char* crs;
    double x, y;
    Vec2 rise;  // to the east and the north
  };
  const Row rows[] = {
      {"EPSG:32633", 500000, 5000000, {0.5, 0.25}},
      {"EPSG:2053", -50000, 3000000, {-0.5, -0.25}},  // x to the west, y to the south
      {"EPSG:2065", 1050000, 600000, {-0.25, -0.5}},  // x to the south, y to the west
      {"EPSG:5514", -600000, -1050000, {0.5, 0.25}},
      {"+proj=utm +zone=33 +axis=wnu +type=crs", -500000, 5000000, {-0.5, 0.25}}};
  for (const Row& row : rows) {
    const auto dem = slanted(dir, row.crs, row.x, row.y);
    const double facing = std::atan2(-row.rise.x, -row.rise.y) * 180 / M_PI;
    const HeightGrid aspect = all_of(*dem, {.kind = Derivative::aspect});
    EXPECT_NEAR(std::remainder(aspect.at(2, 2) - facing, 360), 0, 1e-3) << row.crs;
    EXPECT_NEAR(std::remainder(aspect.at(0, 4) - facing, 360), 0, 1e-3) << row.crs;
    const HeightGrid grey = all_of(*dem, {.kind = Derivative::hillshade});
    EXPECT_EQ(grey.at(2, 2), hillshade_grey(row.rise.x, row.rise.y, {})) << row.crs;
    EXPECT_NEAR(all_of(*dem, {.kind = Derivative::slope, .percent = true}).at(2, 2),
                100 * std::hypot(0.5, 0.25), 1e-3)
        << row.crs;
  }
}

/// The turned globe of a system that counts longitudes to the west.
TEST(Derivatives, OfDegreesToTheWestAndTheSouthFaceTheirNorth) {
  const test::TempDir dir;
  const std::string file = dir.file("west.asc");
  std::ofstream out(file);
  out << "ncols 5\nnrows 5\nxllcorner 10\nyllcorner 50\ncellsize 0.001\n";
  for (int r = 0; r < 5; ++r)
    for (int c = 0; c < 5; ++c) out << 1000 + 5 * c << (c == 4 ? '\n' : ' ');
  out.close();
  const auto dem =
      DemSource::open({&file, 1}, {.crs = "+proj=longlat +datum=WGS84 +axis=wsu +type=crs"});
  ASSERT_TRUE(dem) << dem.error().what;
  EXPECT_NEAR(all_of(**dem, {.kind = Derivative::aspect}).at(2, 2), 90, 1e-3);
}

TEST(Derivatives, OfFlatLandHaveNoAspectAndTheAltitudesGrey) {
  const test::TempDir dir;
  const auto dem = plane(dir, 0, 0);
  EXPECT_TRUE(all_of(*dem, {.kind = Derivative::aspect}).is_void(1, 1));
  DerivativeOptions shade{.kind = Derivative::hillshade};
  EXPECT_EQ(all_of(*dem, shade).at(1, 1), std::round(1 + 254 * std::sin(M_PI / 4)));
  shade.light.altitude_deg = 90;
  EXPECT_EQ(all_of(*dem, shade).at(1, 1), 255);
}

TEST(Derivatives, TakeDegreesForWhatTheyAreOnTheGround) {
  // A degree of longitude at 60 degrees north is half as long as one at the equator.
  for (const double lat : {0.0, 60.0}) {
    HeightGrid grid(9, 9);
    for (int r = 0; r < 9; ++r)
      for (int c = 0; c < 9; ++c) grid.at(c, r) = float(100 * c);
    const MadeUpSource dem(grid, {10, lat}, 0.001);
    const double metres = 0.001 * 111'319.49 * std::cos(lat * M_PI / 180);
    EXPECT_NEAR(all_of(dem, {.kind = Derivative::slope, .percent = true}).at(4, 0),
                100 * 100 / metres, 0.01 * 100 * 100 / metres);
    EXPECT_NEAR(all_of(dem, {.kind = Derivative::aspect}).at(4, 4), 270, 1e-3);
  }
}

/// Heights in a text file, rows from the north.
HeightGrid slopes_of(const test::TempDir& dir, const HeightGrid& grid, Derivative kind) {
  const auto dem = test::text_dem(dir, "some", grid, {10, 50}, 0.001);
  return all_of(*dem, {.kind = kind});
}

TEST(Derivatives, AroundVoidsDoNotDependOnTheOrderOfCorners) {
  const test::TempDir dir;
  // One row leads nowhere but along itself.
  HeightGrid row(4, 1);
  const float heights[] = {5, 6, 7, 9};
  for (int c = 0; c < 4; ++c) row.at(c, 0) = heights[c];
  const HeightGrid aspect = slopes_of(dir, row, Derivative::aspect);
  for (int c = 0; c < 4; ++c) EXPECT_NEAR(aspect.at(c, 0), 270, 1e-4) << c;
  // Turned by half a circle, as steep.
  HeightGrid nine(3, 3), turned(3, 3);
  const float some[] = {HeightGrid::kVoid, 3, 7, 2, 5, 9, 6, 1, HeightGrid::kVoid};
  for (int k = 0; k < 9; ++k) {
    nine.at(k % 3, k / 3) = some[k];
    turned.at(k % 3, k / 3) = some[8 - k];
  }
  EXPECT_NEAR(slopes_of(dir, nine, Derivative::slope).at(1, 1),
              slopes_of(dir, turned, Derivative::slope).at(1, 1), 1e-3);
}

TEST(Derivatives, AtAPoleAreThoseOfThePlaneAroundIt) {
  const test::TempDir dir;
  for (const double pole : {90.0, -90.0}) {
    // A plane over the pole: 0.001 along longitude 0, -0.0005 along longitude 90.
    HeightGrid grid(36, 5);
    for (int r = 0; r < 5; ++r)
      for (int c = 0; c < 36; ++c) {
        const double lon = (-180 + 10 * c) * M_PI / 180, south = pole > 0 ? r : 4 - r;
        const double away = 111'694 * 0.1 * south;  // metres along a meridian there
        grid.at(c, r) = float(1000 + 0.001 * away * std::cos(lon) - 0.0005 * away * std::sin(lon));
      }
    const auto dem = test::text_dem(dir, pole > 0 ? "north" : "south", grid,
                                    {-180, pole > 0 ? 89.6 : -90}, 10, 0.1);
    ASSERT_TRUE(dem);
    const HeightGrid slope = all_of(*dem, {.kind = Derivative::slope, .percent = true});
    const HeightGrid aspect = all_of(*dem, {.kind = Derivative::aspect});
    const int at = pole > 0 ? 0 : 4;
    for (int c = 0; c < 36; ++c) {
      EXPECT_NEAR(slope.at(c, at), 0.1118, 0.001) << c << " " << pole;
      EXPECT_NEAR(slope.at(c, 2), 0.1118, 0.004) << c << " " << pole;
      const double turn = std::remainder(aspect.at(c, at) - aspect.at(c, pole > 0 ? 1 : 3), 360);
      EXPECT_NEAR(turn, 0, 1) << c << " " << pole;  // the next post of the same meridian agrees
    }
  }
}

TEST(Derivatives, OfNeighboursAreByTheirDefinitions) {
  HeightGrid grid(3, 3, 10);
  grid.at(0, 0) = 4, grid.at(2, 1) = 13, grid.at(1, 1) = 11;
  const MadeUpSource dem(grid, {10, 50}, 0.001);
  EXPECT_EQ(all_of(dem, {.kind = Derivative::roughness}).at(1, 1), 9);
  EXPECT_NEAR(all_of(dem, {.kind = Derivative::tri}).at(1, 1), std::sqrt(49 + 4 + 6 * 1), 1e-5);
  EXPECT_NEAR(all_of(dem, {.kind = Derivative::tpi}).at(1, 1), 11 - (4 + 13 + 60) / 8.0, 1e-5);
}

TEST(Derivatives, StripsHaveNoSeams) {
  const MadeUpSource dem(test::terrain_with_voids(60, 50, 3), {10, 50}, 0.01);
  for (const auto& [kind, name] : EnumNames<Derivative>::kAll) {
    const DerivativeOptions options{.kind = kind};
    const HeightGrid whole = all_of(dem, options);
    const RasterRows rows = derivative_rows(dem, options);
    for (int row = 0; row < 50; row += 7) {
      const auto strip = rows(row, std::min(7, 50 - row));
      ASSERT_TRUE(strip);
      for (int r = 0; r < strip->rows(); ++r)
        for (int c = 0; c < 60; ++c) {
          const float a = whole.at(c, row + r), b = strip->at(c, r);
          ASSERT_TRUE(a == b || (std::isnan(a) && std::isnan(b))) << name << c << " " << row + r;
        }
    }
  }
}

}  // namespace
}  // namespace tind
