#include "terrain/raster/contour_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::MadeUpSource;

/// A cone of 100 m in the middle of 41 x 41 posts a hundredth of a degree apart.
MadeUpSource cone() {
  HeightGrid grid(41, 41);
  for (int r = 0; r < 41; ++r)
    for (int c = 0; c < 41; ++c)
      grid.at(c, r) = float(std::max(0.0, 100 - 5 * std::hypot(c - 20, r - 20)));
  return MadeUpSource(grid, {10, 50}, 0.01);
}

nlohmann::json lines_of(const MadeUpSource& dem, const ContourOptions& options) {
  DemInfo info = dem.info();
  info.crs_wkt =
      "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],"
      "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433],AUTHORITY[\"EPSG\",\"4326\"]]";
  const auto made = encode_contours(ContourFormat::geojson, info, dem.grid(), options);
  EXPECT_TRUE(made) << made.error().what;
  auto json = nlohmann::json::parse(made->bytes);
  EXPECT_EQ(json["features"].size(), made->lines);
  return json;
}

TEST(ContourLines, OfAConeAreCircles) {
  const MadeUpSource dem = cone();
  const auto json = lines_of(dem, {.interval_m = 25, .base_m = 5});
  ASSERT_EQ(json["features"].size(), 4u);  // 5, 30, 55, 80
  for (const auto& feature : json["features"]) {
    const double height = feature["properties"]["height_m"];
    const double radius = (100 - height) / 5 * 0.01;
    const auto& points = feature["geometry"]["coordinates"];
    EXPECT_EQ(points.front(), points.back());
    for (const auto& p : points) {
      EXPECT_NEAR(std::hypot(p[0].get<double>() - 10.2, p[1].get<double>() - 49.8), radius, 5e-4);
      EXPECT_EQ(p[2], height);
    }
  }
}

TEST(ContourLines, AreAtTheHeightsThatAreAskedFor) {
  const auto json = lines_of(cone(), {.levels = {90, 12.5, 500}});
  std::vector<double> heights;
  for (const auto& f : json["features"]) heights.push_back(f["properties"]["height_m"]);
  std::ranges::sort(heights);
  EXPECT_EQ(heights, (std::vector<double>{12.5, 90}));
}

TEST(ContourLines, TheSamePostsAreTheSameBytes) {
  const MadeUpSource dem = cone();
  for (const ContourFormat format : {ContourFormat::geopackage, ContourFormat::flatgeobuf}) {
    const auto once = encode_contours(format, dem.info(), dem.grid(), {.interval_m = 10});
    const auto twice = encode_contours(format, dem.info(), dem.grid(), {.interval_m = 10});
    ASSERT_TRUE(once && twice) << once.error().what;
    EXPECT_EQ(once->bytes, twice->bytes);
    EXPECT_EQ(once->lines, 10u);
  }
}

TEST(ContourLines, GoAroundVoids) {
  HeightGrid grid = cone().grid();
  for (int r = 15; r <= 25; ++r)
    for (int c = 0; c <= 40; ++c) grid.at(c, r) = HeightGrid::kVoid;
  const auto json = lines_of(MadeUpSource(grid, {10, 50}, 0.01), {.levels = {30}});
  ASSERT_EQ(json["features"].size(), 2u);  // two arcs
  for (const auto& f : json["features"])
    for (const auto& p : f["geometry"]["coordinates"])
      EXPECT_GE(std::abs(p[1].get<double>() - 49.8), 0.05);
}

TEST(ContourLines, HeightsAreThoseBetweenTwo) {
  EXPECT_EQ(*contour_heights({.interval_m = 25, .base_m = 5}, -21, 56),
            (std::vector<double>{-20, 5, 30, 55}));
  EXPECT_EQ(*contour_heights({.levels = {90, 12.5, 90, 500}}, 0, 100),
            (std::vector<double>{12.5, 90}));
  EXPECT_FALSE(contour_heights({.interval_m = 1e-3}, 0, 100));
}

TEST(ContourAreas, AreInTheDemsCrsWithTheirHeightAndError) {
  const ContourArea area{50,
                         {{{0, 0}, {0, 40}, {40, 40}, {40, 0}}, {{10, 10}, {20, 10}, {20, 20}}}};
  DemInfo info = cone().info();
  info.crs_wkt =
      "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],"
      "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433],AUTHORITY[\"EPSG\",\"4326\"]]";
  const auto made = encode_contour_areas(ContourFormat::geojson, info, std::span(&area, 1), 2.5);
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_EQ(made->lines, 1u);
  const auto json = nlohmann::json::parse(made->bytes);
  const auto& feature = json["features"][0];
  EXPECT_EQ(feature["properties"]["height_m"], 50);
  EXPECT_EQ(feature["properties"]["error_m"], 2.5);
  EXPECT_EQ(feature["geometry"]["type"], "Polygon");
  ASSERT_EQ(feature["geometry"]["coordinates"].size(), 2u);
  double west = 180, north = -90;
  for (const auto& p : feature["geometry"]["coordinates"][0])
    west = std::min<double>(west, p[0]), north = std::max<double>(north, p[1]);
  EXPECT_NEAR(west, 10, 1e-9);
  EXPECT_NEAR(north, 50, 1e-9);
  for (const ContourFormat format : {ContourFormat::geopackage, ContourFormat::flatgeobuf})
    EXPECT_TRUE(encode_contour_areas(format, info, std::span(&area, 1), 2.5));
  info.crs_kind = CrsKind::none;
  EXPECT_FALSE(encode_contour_areas(ContourFormat::geojson, info, std::span(&area, 1), 2.5));
}

TEST(ContourLines, RefuseWhatMakesNoSense) {
  const MadeUpSource dem = cone();
  EXPECT_EQ(encode_contours(ContourFormat::geopackage, dem.info(), dem.grid(), {.interval_m = 1e-3})
                .error()
                .code,
            Errc::invalid_argument);
  DemInfo nowhere = dem.info();
  nowhere.crs_kind = CrsKind::none;
  EXPECT_FALSE(encode_contours(ContourFormat::geojson, nowhere, dem.grid(), {.interval_m = 10}));
  EXPECT_FALSE(contour_format("a.shp"));
  EXPECT_TRUE(contour_format("A.GPKG"));
}

}  // namespace
}  // namespace tind
