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
  double low, high, voids;  // metres, metres, share
  double unit_m = 1;
  VerticalDatum datum = VerticalDatum::unknown;
};

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
  double low = 1e9, high = -1e9, voids = 0;
  for (const float z : grid.values()) {
    if (std::isnan(z))
      ++voids;
    else
      low = std::min<double>(low, z), high = std::max<double>(high, z);
  }
  EXPECT_NEAR(low, want.low, 0.01);
  EXPECT_NEAR(high, want.high, 0.01);
  EXPECT_NEAR(voids / double(grid.size()), want.voids, 0.005);
}

constexpr auto kNone = CrsKind::none, kGeo = CrsKind::geographic, kProj = CrsKind::projected;
INSTANTIATE_TEST_SUITE_P(Shared, EveryDem,
                         testing::Values(Expected{"crater.tif", 336, 459, kNone, 1533, 2478, 0}),
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
