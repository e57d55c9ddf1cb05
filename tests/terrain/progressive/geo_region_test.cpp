// Regions in longitude and latitude, over DEMs that lie anywhere around the earth.

#include "terrain/progressive/multires/geo_region.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/support.h"

namespace tind {
namespace {

using Dem = std::shared_ptr<const DemSource>;

Dem opened(const std::string& file) {
  const std::vector<std::string> files = {file};
  const auto dem = DemSource::open(files);
  EXPECT_TRUE(dem) << dem.error().what;
  return dem ? *dem : nullptr;
}

/// Posts a degree apart, from -20 to 20 degrees north.
Dem degrees(const std::string& file, int west, int cols) {
  std::ofstream(file + ".prj")
      << "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],"
         "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]";
  std::ofstream out(file + ".asc");
  out << "ncols " << cols << "\nnrows 41\nxllcenter " << west
      << "\nyllcenter -20\ncellsize 1\nNODATA_value -9999\n";
  for (int i = 0; i < 41 * cols; ++i) out << i % 50 << (i % cols == cols - 1 ? '\n' : ' ');
  out.close();
  return opened(file + ".asc");
}

/// How many posts the region holds; -1: it is refused.
int posts(const Dem& dem, const GeoRegion& region) {
  const auto over = region.over(*dem);
  if (!over) return -1;
  int count = 0;
  for (int r = 0; r < dem->info().rows; ++r)
    for (int c = 0; c < dem->info().cols; ++c) count += over->contains({double(c), -double(r)});
  return count;
}
int in_box(const Dem& dem, const GeoRect& box) { return posts(dem, GeoRegion::box(box)); }

std::string refused(const Dem& dem, const GeoRegion& region) {
  const auto over = region.over(*dem);
  return over ? "not refused" : over.error().what;
}

TEST(GeoRegion, ABoxAroundTheDemIsAllOfIt) {
  for (const char* name : {"rainier.tif", "bigtujunga_crop.tif"}) {
    const Dem dem = opened(test::testdata(name));
    ASSERT_TRUE(dem);
    const int all = int(dem->info().cols * dem->info().rows);
    for (const GeoRect& box :
         {GeoRect{-130, 30, 58, 60}, GeoRect{-130, 30, 59, 60}, GeoRect{-180, -90, 180, 90},
          GeoRect{-179, -80, 179, 80}, GeoRect{0, -90, 360, 90}, GeoRect{-360, -90, 360, 90},
          GeoRect{200, 30, 300, 60}, GeoRect{-300, 30, -100, 60}})
      EXPECT_EQ(in_box(dem, box), all) << name << " " << box.west << " " << box.east;
    EXPECT_EQ(in_box(dem, {-110, -90, 230, 90}), -1) << name;
  }
}

TEST(GeoRegion, APolygonIsAsWideAsItSaysAndARouteTakesTheShorterWay) {
  const Dem dem = opened(test::testdata("rainier.tif"));
  ASSERT_TRUE(dem);
  const int all = int(dem->info().cols * dem->info().rows);
  EXPECT_EQ(posts(dem, {{{-130, 40}, {59, 40}, {59, 60}, {-130, 60}}}), all);
  EXPECT_EQ(posts(dem, {{{-180, -90}, {180, -90}, {180, 90}, {-180, 90}}}), all);
  EXPECT_EQ(posts(dem, {{{-110, 40}, {60, 40}, {60, 60}, {-110, 60}}}), -1);
  const int part = posts(dem, {{{-121.9, 46.7}, {-121.7, 46.9}}, false, 2000});
  EXPECT_GT(part, 1000);
  EXPECT_EQ(posts(dem, {{{238.1, 46.7}, {-121.7, 46.9}}, false, 2000}), part);
  EXPECT_EQ(posts(dem, {{{-121.9, 46.7}, {238.3, 46.9}}, false, 2000}), part);
}

TEST(GeoRegion, AcrossTheAntimeridianLongitudesCountOn) {
  test::TempDir dir;
  const Dem dem = degrees(dir.file("fiji"), 170, 21);
  ASSERT_TRUE(dem);
  EXPECT_EQ(in_box(dem, {175, -5, 185, 5}), 11 * 11);
  EXPECT_EQ(in_box(dem, {-185, -5, -175, 5}), 11 * 11);
  EXPECT_EQ(in_box(dem, {-190, -5, -175, 5}), 16 * 11);
  EXPECT_EQ(in_box(dem, {-180, -90, 180, 90}), 21 * 41);
  EXPECT_EQ(in_box(dem, {0, -90, 360, 90}), 21 * 41);
  EXPECT_EQ(in_box(dem, {-100, -90, 180, 90}), 11 * 41);
  EXPECT_EQ(in_box(dem, {-180, -90, 100, 90}), 11 * 41);
  EXPECT_NE(refused(dem, GeoRegion::box({-175, -5, 175, 5})).find("both ends"), std::string::npos);
  EXPECT_NE(refused(dem, GeoRegion::box({-165, -5, 165, 5})).find("outside"), std::string::npos);
  const int route = posts(dem, {{{175, 0}, {185, 0}}, false, 1000});
  EXPECT_EQ(route, 11);
  EXPECT_EQ(posts(dem, {{{175, 0}, {-175, 0}}, false, 1000}), route);
}

TEST(GeoRegion, ADemOfTheWholeEarthHasOneSeam) {
  test::TempDir dir;
  for (const int west : {-180, 0}) {
    const Dem dem = degrees(dir.file("world" + std::to_string(west + 180)), west, 360);
    ASSERT_TRUE(dem);
    ASSERT_TRUE(dem->info().wraps_longitude);
    EXPECT_EQ(in_box(dem, {-180, -90, 180, 90}), 360 * 41);
    EXPECT_EQ(in_box(dem, {0, -90, 360, 90}), 360 * 41);
    EXPECT_EQ(in_box(dem, {10, -5, 20, 5}), 11 * 11);
    EXPECT_EQ(in_box(dem, {-350, -5, -340, 5}), 11 * 11);
    EXPECT_EQ(in_box(dem, {double(west), -5, west + 10.0, 5}), 11 * 11);
    const auto across = refused(dem, GeoRegion::box({west - 5.0, -5, west + 5.0, 5}));
    EXPECT_NE(across.find("begin again"), std::string::npos) << across;
  }
}

}  // namespace
}  // namespace tind
