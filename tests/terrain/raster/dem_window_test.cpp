#include "terrain/raster/dem_window.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::MadeUpSource;
using test::rough_terrain;

std::shared_ptr<const DemSource> testdata_dem(const std::string& name) {
  const std::string file = test::testdata(name);
  auto dem = DemSource::open({&file, 1});
  EXPECT_TRUE(dem) << dem.error().what;
  return *dem;
}

/// The window has the posts of the whole, at the same places, and none beside it.
void expect_same_posts(const DemSource& whole, const DemSource& part, const PostRect& rect) {
  const int cols = int(part.info().cols), rows = int(part.info().rows);
  ASSERT_EQ(cols, rect.last_col - rect.col + 1);
  ASSERT_EQ(rows, rect.last_row - rect.row + 1);
  const auto a = whole.read(rect.col, rect.row, cols, rows),
             b = part.read(-1, -1, cols + 2, rows + 2);
  ASSERT_TRUE(a && b);
  for (int r = -1; r <= rows; ++r)
    for (int c = -1; c <= cols; ++c) {
      const float z = b->at(c + 1, r + 1);
      if (c < 0 || r < 0 || c == cols || r == rows) {
        ASSERT_TRUE(std::isnan(z)) << c << " " << r;
      } else if (!a->is_void(c, r)) {
        ASSERT_EQ(a->at(c, r), z) << c << " " << r;
      }
    }
  const Vec2 here[] = {{1.25, 2.5}}, there[] = {{rect.col + 1.25, rect.row + 2.5}};
  Geographic p[1], q[1];
  part.to_geographic(here, p), whole.to_geographic(there, q);
  EXPECT_EQ(p[0].lon, q[0].lon);
  EXPECT_EQ(p[0].lat, q[0].lat);
  Vec2 back[1];
  part.to_post(p, back);
  EXPECT_NEAR(back[0].x, 1.25, 1e-6);
  EXPECT_NEAR(back[0].y, 2.5, 1e-6);
  const Vec2 a_crs = part.info().post_to_crs.apply(1.25, 2.5);
  const Vec2 b_crs = whole.info().post_to_crs.apply(rect.col + 1.25, rect.row + 2.5);
  EXPECT_NEAR(a_crs.x, b_crs.x, 1e-9 * std::abs(b_crs.x));
  EXPECT_NEAR(a_crs.y, b_crs.y, 1e-9 * std::abs(b_crs.y));
}

TEST(DemWindow, IsTheSmallestRectangleOfPostsAroundAnArea) {
  // Posts a hundredth of a degree apart from 10, 50 on.
  const auto whole =
      std::make_shared<const MadeUpSource>(rough_terrain(101, 81, 5), Geographic{10, 50}, 0.01);
  const auto rect = posts_around(*whole, outline_of({10.205, 49.5, 10.401, 49.695}));
  ASSERT_TRUE(rect) << rect.error().what;
  EXPECT_EQ(*rect, (PostRect{20, 30, 41, 50}));
  const auto part = dem_window(whole, *rect);
  expect_same_posts(*whole, *part, *rect);
  EXPECT_NEAR(part->info().bounds.west, 10.20, 1e-9);
  EXPECT_NEAR(part->info().bounds.south, 49.50, 1e-9);
  EXPECT_NEAR(part->info().bounds.east, 10.41, 1e-9);
  EXPECT_NEAR(part->info().bounds.north, 49.70, 1e-9);
  EXPECT_NE(part->info().fingerprint, whole->info().fingerprint);
  // Posts are as far apart as at this latitude, not as in the middle of the whole.
  EXPECT_NEAR(part->info().spacing_x_m, 0.01 * 111'320 * std::cos(49.6 * M_PI / 180), 3);
}

TEST(DemWindow, EndsWhereTheDemDoesAndIsNoneBesideIt) {
  const auto whole =
      std::make_shared<const MadeUpSource>(rough_terrain(50, 50, 5), Geographic{10, 50}, 0.01);
  const auto rect = posts_around(*whole, outline_of({9, 49.9, 10.05, 51}));
  ASSERT_TRUE(rect);
  EXPECT_EQ(*rect, (PostRect{0, 0, 5, 10}));
  const auto none = posts_around(*whole, outline_of({20, 49, 21, 50}));
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, Errc::out_of_range);
  EXPECT_NE(none.error().what.find("10.0000,49.5"), std::string::npos) << none.error().what;
}

TEST(DemWindow, OfAProjectedDem) {
  const auto whole = testdata_dem("bigtujunga_crop.tif");
  ASSERT_EQ(whole->info().crs_kind, CrsKind::projected);
  const GeoRect b = whole->info().bounds;
  const GeoRect area{b.west + b.width() * .3, b.south + b.height() * .4, b.west + b.width() * .5,
                     b.south + b.height() * .6};
  const auto rect = posts_around(*whole, outline_of(area));
  ASSERT_TRUE(rect) << rect.error().what;
  const auto part = dem_window(whole, *rect);
  expect_same_posts(*whole, *part, *rect);
  const GeoRect got = part->info().bounds;
  EXPECT_LE(got.west, area.west + 1e-9);
  EXPECT_GE(got.east, area.east - 1e-9);
  EXPECT_LE(got.south, area.south + 1e-9);
  EXPECT_GE(got.north, area.north - 1e-9);
}

TEST(DemWindow, AcrossTheAntimeridianOfADemAroundTheGlobe) {
  const test::TempDir dir;
  const std::string file = dir.file("world.asc");
  {
    std::ofstream out(file);
    out << "ncols 72\nnrows 36\nxllcorner -180\nyllcorner -90\ncellsize 5\n";
    for (int r = 0; r < 36; ++r)
      for (int c = 0; c < 72; ++c) out << r * 100 + c << (c == 71 ? '\n' : ' ');
  }
  auto opened = DemSource::open({&file, 1}, {.crs = "EPSG:4326"});
  ASSERT_TRUE(opened) << opened.error().what;
  const std::shared_ptr<const DemSource> whole = *opened;
  ASSERT_TRUE(whole->info().wraps_longitude);
  const auto rect = posts_around(*whole, outline_of({160, -20, 200, 20}));
  ASSERT_TRUE(rect) << rect.error().what;
  const auto part = dem_window(whole, *rect);
  EXPECT_FALSE(part->info().wraps_longitude);
  expect_same_posts(*whole, *part, *rect);
  EXPECT_EQ(part->info().cols, 10);  // 157.5 to 202.5
  EXPECT_EQ(part->info().bounds.west, -180);
  EXPECT_EQ(part->info().bounds.east, 180);
  for (const double half : {60., 88., 100., 140., 170.}) {
    const auto wide = posts_around(*whole, outline_of({-half, -50, half, 50}));
    ASSERT_TRUE(wide);
    const double from = std::floor((180 - half - 2.5) / 5), to = std::ceil((180 + half - 2.5) / 5);
    EXPECT_EQ(wide->last_col - wide->col, std::int64_t(to - from)) << half;
  }
  const auto all = posts_around(*whole, outline_of({-180, -90, 180, 90}));
  ASSERT_TRUE(all);
  EXPECT_EQ(*all, (PostRect{0, 0, 71, 35}));
}

}  // namespace
}  // namespace tind
