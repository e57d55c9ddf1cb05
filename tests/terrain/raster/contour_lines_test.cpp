#include "terrain/raster/contour_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

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

/// 41 x 41 posts in a projected CRS, around a place of it, where the globe is cut or ends.
struct Place {
  const char* crs;
  double x, y, spacing;
};
constexpr Place kCut[] = {{"EPSG:32760", 820'900, 8'208'000, 100},  // the antimeridian, Fiji
                          {"EPSG:3995", 0, 780'000, 1000},          // beside the north pole
                          {"EPSG:3413", 0, 0, 1000},                // the poles are posts
                          {"EPSG:3031", 0, 0, 1000},
                          {"EPSG:3413", 500, -500, 1000}};  // between posts

class Projected {
 public:
  /// Heights are a function of the metres from the middle.
  Projected(const Place& place, const std::function<double(double, double)>& height) {
    const std::string path = folder_.file("dem.asc");
    std::ofstream out(path);
    out.precision(17);
    out << "ncols 41\nnrows 41\nxllcenter " << place.x - 20 * place.spacing << "\nyllcenter "
        << place.y - 20 * place.spacing << "\ncellsize " << place.spacing << "\n";
    for (int r = 0; r < 41; ++r)
      for (int c = 0; c < 41; ++c)
        out << height((c - 20) * place.spacing, (20 - r) * place.spacing) << (c < 40 ? ' ' : '\n');
    out.close();
    DemOptions options;
    options.crs = place.crs;
    auto opened = DemSource::open({&path, 1}, options);
    if (!opened) throw std::runtime_error(opened.error().what);
    dem_ = *opened;
  }

  const DemSource& dem() const { return *dem_; }
  nlohmann::json lines(const ContourOptions& options) const {
    const auto made =
        encode_contours(ContourFormat::geojson, dem_->info(), *dem_->read(0, 0, 41, 41), options);
    EXPECT_TRUE(made) << made.error().what;
    return made ? nlohmann::json::parse(made->bytes) : nlohmann::json();
  }
  nlohmann::json area(const std::vector<std::vector<Vec2>>& rings) const {
    const ContourArea area{50, rings};
    const auto made = encode_contour_areas(ContourFormat::geojson, dem_->info(), {&area, 1}, 1);
    EXPECT_TRUE(made) << made.error().what;
    return made ? nlohmann::json::parse(made->bytes)["features"][0]["geometry"] : nlohmann::json();
  }
  Geographic place(Vec2 post) const {
    Geographic at;
    dem_->to_geographic({&post, 1}, {&at, 1});
    return at;
  }
  Vec2 post(Geographic place) const {
    Vec2 at;
    dem_->to_post({&place, 1}, {&at, 1});
    return at;
  }

 private:
  test::TempDir folder_;
  std::shared_ptr<const DemSource> dem_;
};

using Chain = std::vector<std::vector<double>>;

/// The lines and rings of a geometry.
void chains_of(const nlohmann::json& coordinates, std::vector<Chain>& out) {
  if (coordinates[0][0].is_number())
    out.push_back(coordinates.get<Chain>());
  else
    for (const auto& part : coordinates) chains_of(part, out);
}
std::vector<Chain> chains_of(const nlohmann::json& geometry) {
  std::vector<Chain> all;
  if (!geometry.is_null()) chains_of(geometry["coordinates"], all);
  return all;
}

/// On one map of the world, from which nothing juts out and around which nothing goes.
void expect_on_the_map(const Chain& chain) {
  for (std::size_t i = 0; i < chain.size(); ++i) {
    EXPECT_LE(std::abs(chain[i][0]), 180);
    EXPECT_LE(std::abs(chain[i][1]), 90);
    if (i > 0) {
      EXPECT_LE(std::abs(chain[i][0] - chain[i - 1][0]), 180);
    }
  }
}

bool is_in(const std::vector<Chain>& rings, double x, double y) {
  bool inside = false;
  for (const Chain& ring : rings)
    for (std::size_t i = 1; i < ring.size(); ++i) {
      const double xi = ring[i][0], yi = ring[i][1], xj = ring[i - 1][0], yj = ring[i - 1][1];
      if ((yi > y) != (yj > y) && x < (xj - xi) * (y - yi) / (yj - yi) + xi) inside = !inside;
    }
  return inside;
}
bool is_in(const std::vector<std::vector<Vec2>>& rings, Vec2 post) {
  std::vector<Chain> chains;
  for (const auto& ring : rings) {
    Chain& chain = chains.emplace_back();
    for (const Vec2& p : ring) chain.push_back({p.x, p.y});
    chain.push_back(chain.front());
  }
  return is_in(chains, post.x, post.y);
}

TEST(ContourLines, AreCutAtTheAntimeridianWithTheirHeights) {
  for (const Place& place : kCut) {
    SCOPED_TRACE(place.crs);
    const double s = place.spacing;
    const Projected dem(place, [&](double x, double y) {
      return 500 + 100 * std::sin(x / (3 * s)) + 100 * std::cos(y / (4 * s)) + y / s;
    });
    std::size_t cut = 0;
    const auto json = dem.lines({.interval_m = 25});
    for (const auto& feature : json["features"]) {
      const auto parts = chains_of(feature["geometry"]);
      cut += parts.size() > 1;
      for (const Chain& part : parts) {
        expect_on_the_map(part);
        for (const auto& p : part) EXPECT_EQ(p[2], feature["properties"]["height_m"]);
      }
      for (std::size_t i = 1; i < parts.size(); ++i) {
        EXPECT_EQ(parts[i - 1].back()[0], -parts[i].front()[0]);
        EXPECT_EQ(parts[i - 1].back()[1], parts[i].front()[1]);
        EXPECT_EQ(std::abs(parts[i].front()[0]), 180);
      }
    }
    EXPECT_GT(cut, 3u);
  }
}

TEST(ContourLines, BesideAPoleAreWhereTheyAreInTheirCrs) {
  for (const Place& place : kCut) {
    if (place.y > 1000) continue;
    SCOPED_TRACE(place.crs);
    const Projected dem(place, [](double x, double y) { return (x + 0.7 * y) / 100; });
    const auto json = dem.lines({.interval_m = 2});
    EXPECT_GT(json["features"].size(), 100u);
    for (const auto& feature : json["features"])
      for (const Chain& part : chains_of(feature["geometry"]))
        for (std::size_t i = 1; i < part.size(); ++i)
          for (const double t : {0.0, 0.3, 0.5, 1.0}) {
            const auto at = [&](int k) {
              return part[i - 1][k] + t * (part[i][k] - part[i - 1][k]);
            };
            const Vec2 post = dem.post({at(0), at(1)});
            if (std::abs(post.x - 20) > 19 || std::abs(post.y - 20) > 19) continue;
            EXPECT_NEAR(10 * (post.x - 20) + 7 * (20 - post.y), at(2), 0.2);
          }
  }
}

TEST(ContourLines, OfPostsOnThePolesEndThere) {
  HeightGrid grid(73, 37);
  for (int r = 0; r < 37; ++r)
    for (int c = 0; c < 73; ++c) grid.at(c, r) = float(std::abs(c - 36));
  const auto json = lines_of(MadeUpSource(grid, {-180, 90}, 5), {.levels = {10}});
  ASSERT_EQ(json["features"].size(), 2u);
  for (const auto& feature : json["features"]) {
    double south = 90, north = -90;
    for (const Chain& part : chains_of(feature["geometry"])) {
      expect_on_the_map(part);
      for (const auto& p : part) south = std::min(south, p[1]), north = std::max(north, p[1]);
    }
    EXPECT_EQ(south, -90);
    EXPECT_EQ(north, 90);
  }
}

TEST(ContourAreas, AreCutAtTheAntimeridianAndEndAtThePoles) {
  const auto square = [](double from, double to) {
    return std::vector<Vec2>{{from, from}, {from, to}, {to, to}, {to, from}};
  };
  const std::vector<std::vector<std::vector<Vec2>>> areas = {
      {square(5, 35)},
      {square(5, 35), square(15, 24)},                 // with a hole across, or around the pole
      {square(5, 35), square(8, 12), square(25, 30)},  // with holes beside it
      {square(5, 20)},                                 // with a corner on it
      {{{5, 5}, {5, 35}, {20, 35}, {20, 5}}},          // with a side through it
      {{{2, 2}, {2, 38}, {38, 38}, {38, 2}, {35, 2}, {35, 35}, {5, 35}, {5, 2}}}};
  for (const Place& place : kCut) {
    const Projected dem(place, [](double, double) { return 0; });
    for (std::size_t k = 0; k < areas.size(); ++k) {
      SCOPED_TRACE(std::string(place.crs) + ", area " + std::to_string(k));
      const auto geometry = dem.area(areas[k]);
      const auto rings = chains_of(geometry);
      for (const Chain& ring : rings) expect_on_the_map(ring);
      std::size_t wrong = 0;
      for (double row = 0.43; row < 40; row += 0.71)
        for (double col = 0.41; col < 40; col += 0.71) {
          const Geographic at = dem.place({col, row});
          wrong += is_in(rings, at.lon, at.lat) != is_in(areas[k], {col, row});
        }
      EXPECT_EQ(wrong, 0u);
    }
  }
}

TEST(ContourAreas, AroundBothPolesAreRefused) {
  const Projected dem({"+proj=laea +lat_0=0 +lon_0=180", 0, 0, 480'000},
                      [](double, double) { return 0; });
  const ContourArea area{50, {{{5, 0}, {5, 40}, {35, 40}, {35, 0}}}};
  EXPECT_FALSE(encode_contour_areas(ContourFormat::geojson, dem.dem().info(), {&area, 1}, 1));
  EXPECT_TRUE(encode_contour_areas(ContourFormat::geopackage, dem.dem().info(), {&area, 1}, 1));
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
