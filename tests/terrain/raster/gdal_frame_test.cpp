// Places of posts against what gdaltransform says of the same files, and the odd longitudes.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "terrain/geo/ellipsoid.h"
#include "terrain/raster/dem_source.h"
#include "tests/support/projected_dem.h"
#include "tests/support/support.h"

namespace tind {
namespace {

std::shared_ptr<const DemSource> must_open(std::vector<std::string> files) {
  auto source = DemSource::open(files);
  EXPECT_TRUE(source.has_value()) << (source ? "" : source.error().what);
  return source ? *source : nullptr;
}

double metres_apart(Geographic a, Geographic b) {
  return length(wgs84::to_ecef(a, 0) - wgs84::to_ecef(b, 0));
}

TEST(Frame, PostsAreWhereGdalSaysTheyAre) {
  TIND_NEEDS_SHARED_DATA(folder, "dem");
  const struct {
    const char* file;
    double col, row, lon, lat;
  } known[] = {
      {"SainteHelens.dem", 0, 0, -122.2510942768, 46.2507853295},
      {"SainteHelens.dem", 326, 467, -122.1262294785, 46.1238075725},
      {"swissalti_2.5m_lv95.tif", 0, 0, 7.0906411123, 45.9250425045},
      {"swissalti_2.5m_lv95.tif", 399, 399, 7.1035536596, 45.9161089322},
      {"autzen_minz_3ft_epsg2994.tif", 0, 0, -123.0734630713, 44.0514454686},
      {"autzen_minz_3ft_epsg2994.tif", 393, 187, -123.0689131451, 44.0500082512},
      {"bigtujunga.tif", 0, 0, -118.3455678957, 34.4051725623},
      {"bigtujunga.tif", 1196, 642, -117.9532783325, 34.2351724128},
      {"mt_rainier_90m.tif", 0, 0, -122, 47},
      {"N49W124.tif", 1200, 1200, -123, 49},
      {"n33_w116_3arc_v2.dt1", 0, 1200, -116, 33},
  };
  for (const auto& k : known) {
    const auto source = must_open({folder + "/" + k.file});
    ASSERT_TRUE(source);
    const Vec2 post{k.col, k.row};
    Geographic place;
    source->to_geographic({&post, 1}, {&place, 1});
    EXPECT_LT(metres_apart(place, {k.lon, k.lat}), 1e-4) << k.file;
    Vec2 back;
    source->to_post({&place, 1}, {&back, 1});
    EXPECT_NEAR(back.x, k.col, 1e-6) << k.file;
    EXPECT_NEAR(back.y, k.row, 1e-6) << k.file;
  }
}

/// The same point alone and among far ones: OGR itself would choose another operation.
TEST(Frame, APointDoesNotDependOnItsBatch) {
  TIND_NEEDS_SHARED_DATA(file, "dem/SainteHelens.dem");
  const auto source = must_open({file});
  std::vector<Vec2> posts = {{5, 7}};
  for (int i = 1; i < 200; ++i) posts.push_back({i * 150.0, i * -90.0});
  std::vector<Geographic> together(posts.size());
  source->to_geographic(posts, together);
  for (std::size_t i = 0; i < posts.size(); i += 33) {
    Geographic alone;
    source->to_geographic({&posts[i], 1}, {&alone, 1});
    EXPECT_EQ(alone, together[i]) << alone.lon << " " << together[i].lon;
  }
}

TEST(Frame, PointsWithoutAPlaceAreNaN) {
  const auto source = must_open({test::testdata("bigtujunga_crop.tif")});
  const Vec2 far{1e12, 1e12};
  Geographic place;
  source->to_geographic({&far, 1}, {&place, 1});
  EXPECT_TRUE(std::isnan(place.lon) && std::isnan(place.lat));
}

/// Web Mercator cuts the globe at the antimeridian: a place there has one height all the same.
TEST(Frame, TheAntimeridianIsOnePlace) {
  const double end = 20037508.342789244;
  const test::TempDir folder;
  const auto column_at = [&](const test::ProjectedDem& dem, double lon) {
    const auto source = test::open_projected(dem, folder);
    const Geographic place{lon, 1};
    Vec2 post{};
    if (source) source->to_post({&place, 1}, {&post, 1});
    return post.x;
  };
  const test::ProjectedDem globe{"globe", "EPSG:3857", -end, 9e6, end / 20, 41, 18},
      east{"east", "EPSG:3857", end - 40e4, 9e6, 1e4, 41, 1800},
      west{"west", "EPSG:3857", -end, 9e6, 1e4, 41, 1800};
  for (const double lon : {-180, 180}) {
    EXPECT_NEAR(column_at(globe, lon), 0, 1e-6);
    EXPECT_NEAR(column_at(east, lon), 40, 1e-6);
    EXPECT_NEAR(column_at(west, lon), 0, 1e-6);
  }
}

class Longitudes : public testing::Test {
 protected:
  /// A WGS84 ASCII grid of `cols` x `rows` posts, height = column + 1000 * row.
  std::shared_ptr<const DemSource> grid(int cols, int rows, double west, double north,
                                        double step) {
    const std::string path = folder_.file("grid" + std::to_string(++count_) + ".asc");
    std::ofstream out(path);
    out.precision(17);
    out << "ncols " << cols << "\nnrows " << rows << "\nxllcenter " << west << "\nyllcenter "
        << north - (rows - 1) * step << "\ncellsize " << step << "\nNODATA_value -9999\n";
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < cols; ++c) out << c + 1000 * r << (c + 1 < cols ? ' ' : '\n');
    out.close();
    std::ofstream(path.substr(0, path.size() - 3) + "prj")
        << "GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137,"
           "298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"Degree\",0.017453292519943295]]";
    return must_open({path});
  }
  test::TempDir folder_;
  int count_ = 0;
};

double column_of(const DemSource& source, double lon, double lat = 0) {
  const Geographic place{lon, lat};
  Vec2 post;
  source.to_post({&place, 1}, {&post, 1});
  return post.x;
}

TEST_F(Longitudes, ZeroTo360IsTheWholeGlobe) {
  const auto source = grid(36, 19, 0, 90, 10);
  ASSERT_TRUE(source);
  const DemInfo& info = source->info();
  EXPECT_TRUE(source->is_plain_geographic());
  EXPECT_TRUE(info.wraps_longitude);
  EXPECT_EQ(info.period_cols, 36);
  EXPECT_EQ(info.bounds, (GeoRect{-180, -90, 180, 90}));
  EXPECT_NEAR(column_of(*source, -10), 35, 1e-9);
  EXPECT_NEAR(column_of(*source, 350), 35, 1e-9);
  EXPECT_NEAR(column_of(*source, -180), 18, 1e-9);
  EXPECT_NEAR(column_of(*source, 180), 18, 1e-9);
  const auto across = height_at(*source, {-5, 0});  // between the last column and the first
  ASSERT_TRUE(across) << across.error().what;
  EXPECT_EQ(across->coverage, Coverage::value);
  EXPECT_NEAR(across->height_m, 9000 + (35 + 0) / 2.0, 1e-6);
  const auto around = source->read(-2, 3, 76, 1);
  ASSERT_TRUE(around);
  for (int i = 0; i < 76; ++i) EXPECT_EQ(around->at(i, 0), 3000 + (i - 2 + 36) % 36);
}

TEST_F(Longitudes, OneColumnTooManyOrTooFew) {
  const auto more = grid(37, 19, -180, 90, 10), fewer = grid(35, 19, -180, 90, 10);
  ASSERT_TRUE(more && fewer);
  EXPECT_TRUE(more->info().wraps_longitude);
  EXPECT_EQ(more->info().period_cols, 36);
  EXPECT_EQ(more->read(36, 0, 1, 1)->at(0, 0), 0);
  EXPECT_TRUE(fewer->info().wraps_longitude);
  EXPECT_TRUE(fewer->read(35, 0, 1, 1)->is_void(0, 0));
  EXPECT_EQ(fewer->read(36, 0, 1, 1)->at(0, 0), 0);
  EXPECT_FALSE(grid(34, 19, -180, 90, 10)->info().wraps_longitude);
}

TEST_F(Longitudes, RowsBeyondThePolesAreVoid) {
  const auto source = grid(36, 21, 0, 100, 10);
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().bounds, (GeoRect{-180, -90, 180, 90}));
  const auto column = source->read(4, 0, 1, 21);
  ASSERT_TRUE(column);
  EXPECT_TRUE(column->is_void(0, 0) && column->is_void(0, 20));
  EXPECT_FALSE(column->is_void(0, 1) || column->is_void(0, 19));
}

TEST_F(Longitudes, AcrossTheAntimeridian) {
  const auto source = grid(21, 5, 170, 2, 1);  // 170 .. 190
  ASSERT_TRUE(source);
  EXPECT_FALSE(source->info().wraps_longitude);
  EXPECT_EQ(source->info().bounds, (GeoRect{-180, -2, 180, 2}));
  EXPECT_NEAR(column_of(*source, 175), 5, 1e-9);
  EXPECT_NEAR(column_of(*source, -175), 15, 1e-9);
  EXPECT_EQ(height_at(*source, {-170, 0})->height_m, 2020);
  EXPECT_EQ(height_at(*source, {-169, 0})->coverage, Coverage::outside);
  const auto east = grid(11, 5, 350, 2, 1);  // 350 .. 360 is -10 .. 0
  EXPECT_EQ(east->info().bounds, (GeoRect{-10, -2, 0, 2}));
  EXPECT_NEAR(column_of(*east, -3), 7, 1e-9);
  const auto touching = grid(11, 5, 170, 2, 1);
  EXPECT_EQ(touching->info().bounds, (GeoRect{170, -2, 180, 2}));
}

TEST_F(Longitudes, Etopo5) {
  TIND_NEEDS_SHARED_DATA(file, "dem/etopo5_int16.tif");
  const auto source = must_open({file});
  const DemInfo& info = source->info();
  EXPECT_TRUE(info.wraps_longitude);
  EXPECT_EQ(info.period_cols, 4320);
  EXPECT_NEAR(info.spacing_y_m, 9215, 5);
  const auto everest = height_at(*source, {86.9167, 28});
  ASSERT_TRUE(everest);
  EXPECT_GT(everest->height_m, 5000);
  const auto a = height_at(*source, {-1e-7, 51}), b = height_at(*source, {1e-7, 51});
  ASSERT_TRUE(a && b);
  EXPECT_NEAR(a->height_m, b->height_m, 0.01);
}

TEST(Frame, BoundsHoldEveryPost) {
  for (const char* name : {"bigtujunga_crop.tif", "rainier.tif"}) {
    const auto source = must_open({test::testdata(name)});
    const DemInfo& info = source->info();
    for (std::int64_t row = 0; row < info.rows; row += 3) {
      std::vector<Vec2> posts;
      for (std::int64_t col = 0; col < info.cols; ++col)
        posts.push_back({double(col), double(row)});
      std::vector<Geographic> places(posts.size());
      source->to_geographic(posts, places);
      for (const Geographic& p : places) {
        EXPECT_GE(p.lon, info.bounds.west - 1e-8);
        EXPECT_LE(p.lon, info.bounds.east + 1e-8);
        EXPECT_GE(p.lat, info.bounds.south - 1e-8);
        EXPECT_LE(p.lat, info.bounds.north + 1e-8);
      }
    }
  }
}

TEST(Frame, SpacingOnTheGround) {
  const DemInfo utm = must_open({test::testdata("bigtujunga_crop.tif")})->info();
  EXPECT_NEAR(utm.spacing_x_m, 30, 0.02);
  EXPECT_NEAR(utm.spacing_y_m, 30, 0.02);
  const DemInfo plain = must_open({test::testdata("rainier.tif")})->info();
  EXPECT_NEAR(plain.spacing_x_m, 63.6, 0.1);
  EXPECT_NEAR(plain.spacing_y_m, 92.6, 0.1);
}

}  // namespace
}  // namespace tind
