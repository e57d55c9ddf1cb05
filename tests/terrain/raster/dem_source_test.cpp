// Real DEMs, one line each: what they are must be what tind says they are.

#include "terrain/raster/dem_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/support.h"

namespace tind {
namespace {

std::shared_ptr<const DemSource> must_open(std::vector<std::string> files,
                                           DemOptions options = {}) {
  options.environment = test::environment();
  auto source = DemSource::open(files, options);
  EXPECT_TRUE(source.has_value()) << (source ? "" : source.error().what);
  return source ? *source : nullptr;
}

HeightGrid must_read(const DemSource& source) {
  auto grid = source.read(0, 0, int(source.info().cols), int(source.info().rows));
  EXPECT_TRUE(grid.has_value()) << (grid ? "" : grid.error().what);
  return grid ? std::move(*grid) : HeightGrid();
}

struct Expected {
  const char* file;
  int cols, rows;
  CrsKind kind;
  double low, high, voids, sum;  // of what GDAL reads, in the file's unit; voids as a share
  double unit_m = 1;
  VerticalDatum datum = VerticalDatum::unknown;
};

void PrintTo(const Expected& dem, std::ostream* out) { *out << dem.file; }

class EveryDem : public testing::TestWithParam<Expected> {};

TEST_P(EveryDem, SaysWhatItIs) {
  const Expected& want = GetParam();
  TIND_NEEDS_SHARED_DATA(path, std::string("dem/") + want.file);
  const auto source = must_open({path});
  ASSERT_TRUE(source);
  const DemInfo& info = source->info();
  EXPECT_EQ(info.cols, want.cols);
  EXPECT_EQ(info.rows, want.rows);
  EXPECT_EQ(info.crs_kind, want.kind);
  EXPECT_NEAR(info.z_unit_m, want.unit_m, 1e-12);
  EXPECT_EQ(info.source_datum, want.datum);
  const HeightGrid grid = must_read(*source);
  double low = 1e9, high = -1e9, sum = 0, voids = 0;
  for (const float z : grid.values()) {
    if (std::isnan(z))
      ++voids;
    else
      low = std::min<double>(low, z), high = std::max<double>(high, z), sum += z;
  }
  EXPECT_NEAR(low, want.low * want.unit_m, info.rounding_m);
  EXPECT_NEAR(high, want.high * want.unit_m, info.rounding_m);
  EXPECT_NEAR(voids / double(grid.size()), want.voids, 5e-6);
  EXPECT_NEAR(sum, want.sum * want.unit_m, 1e-3 + info.rounding_m * double(grid.size()));
}

constexpr auto kNone = CrsKind::none, kGeo = CrsKind::geographic, kProj = CrsKind::projected;
constexpr auto kEgm96 = VerticalDatum::egm96;
INSTANTIATE_TEST_SUITE_P(
    Shared, EveryDem,
    testing::Values(
        Expected{"crater.tif", 336, 459, kNone, 1533, 2478, 0, 292525356},
        Expected{"ashby.tif", 346, 452, kNone, 113, 587, 0, 39427984},
        Expected{"westUS.tif", 1024, 1024, kNone, 1459, 3443, 0, 2188420540},
        Expected{"ps_height_1k.png", 1025, 1025, kNone, 0, 43798, 0, 5813108002},
        Expected{"bigtujunga.tif", 1197, 643, kProj, 315, 2295, 0, 944102028},
        Expected{"mt_rainier_90m.tif", 1201, 1201, kGeo, 263, 4371, .00626, 1787941457},
        Expected{"N49W123.tif", 1201, 1201, kGeo, -37, 2674, .02421, 1062254231},
        Expected{"N49W124.tif", 1201, 1201, kGeo, -26, 2630, .01776, 620663220},
        Expected{"N41E001.hgt.zip", 1201, 1201, kGeo, -20, 1204, .00009, 535401221, 1, kEgm96},
        Expected{"N42E001.hgt.zip", 1201, 1201, kGeo, 349, 3100, .00531, 1969219669, 1, kEgm96},
        Expected{"N52E008.hgt.zip", 1201, 1201, kGeo, -1, 357, 0, 92895436, 1, kEgm96},
        Expected{"N48W125.hgt.zip", 3601, 3601, kGeo, -13, 1095, .50002, 631799673, 1, kEgm96},
        Expected{"etopo5_int16.tif", 4320, 2161, kGeo, -10376, 7833, 0, -17679645880},
        Expected{"n33_w116_3arc_v2.dt1", 1201, 1201, kGeo, -87, 1619, 0, 476864938, 1, kEgm96},
        Expected{"SainteHelens.dem", 327, 468, kProj, 682, 2543, .02712, 192320028},
        Expected{"swissalti_2.5m_lv95.tif", 400, 400, kProj, 1615.817138671875, 2015.094482421875,
                 0, 280725410.208252},
        Expected{"zSW3.asc", 300, 452, kNone, -2.609347105026245, 8.461376190185547, .25923,
                 134508.949158},
        Expected{"autzen_minz_3ft_epsg2994.tif", 394, 188, kProj, 406.260009765625,
                 508.1400146484375, .46224, 16946479.721283, 0.3048},
        Expected{"gcanyon_elev_crop.bw.png", 1200, 1200, kNone, 35, 187, 0, 173867101},
        Expected{"rmnp-dem.tif", 152, 187, kGeo, 2281, 4261, 0, 88657621},
        Expected{"jacksboro_fault_dem.tif", 403, 344, kGeo, 236, 1076, 0, 73617913}),
    [](const auto& dem) {
      std::string text = dem.param.file;
      for (char& c : text) c = std::isalnum(c) ? c : '_';
      return text;
    });

TEST(DemSource, PostToGeographicAndBack) {
  const auto source = must_open({test::testdata("bigtujunga_crop.tif")});
  ASSERT_TRUE(source);
  const Vec2 post{17, 23};
  Geographic place;
  source->to_geographic({&post, 1}, {&place, 1});
  EXPECT_GT(place.lon, -119);
  EXPECT_LT(place.lon, -118);
  Vec2 back;
  source->to_post({&place, 1}, {&back, 1});
  EXPECT_NEAR(back.x, post.x, 1e-6);
  EXPECT_NEAR(back.y, post.y, 1e-6);
}

TEST(DemSource, RainierToEllipsoid) {
  const auto source = must_open({test::testdata("rainier.tif")});
  const auto shifted =
      must_open({test::testdata("rainier.tif")}, {.to_datum = TargetDatum::ellipsoid});
  ASSERT_TRUE(source && shifted);
  EXPECT_EQ(source->info().datum, VerticalDatum::egm96);
  EXPECT_EQ(shifted->info().datum, VerticalDatum::ellipsoid);
  const auto a = height_at(*source, {-121.76, 46.8525}),
             b = height_at(*shifted, {-121.76, 46.8525});
  ASSERT_TRUE(a && b);
  EXPECT_NEAR(b->height_m - a->height_m, -18.5, 1.5);
}

}  // namespace
}  // namespace tind
