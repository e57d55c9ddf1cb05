// Where rasters are that somebody wrote by a hair, or by a world, otherwise than usual.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "terrain/raster/dem_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using testing::HasSubstr;

class DemPlaces : public testing::Test {
 protected:
  const test::TempDir folder_;

  /// 4 x 3 posts, 0 to 11.
  std::string numbers() {
    std::ofstream(folder_.file("n.asc"))
        << "ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
           "0 1 2 3\n4 5 6 7\n8 9 10 11\n";
    return "n.asc";
  }
  /// The same where a geotransform says, with what else a band has.
  std::string placed(const std::string& name, const std::string& geotransform,
                     const std::string& crs = "EPSG:4326", const std::string& band = "") {
    const std::string path = folder_.file(name);
    std::ofstream(path) << "<VRTDataset rasterXSize=\"4\" rasterYSize=\"3\"><SRS>" << crs
                        << "</SRS><GeoTransform>" << geotransform
                        << "</GeoTransform><VRTRasterBand dataType=\"Float32\" band=\"1\">" << band
                        << "<SimpleSource><SourceFilename relativeToVRT=\"1\">" << numbers()
                        << "</SourceFilename><SourceBand>1</SourceBand></SimpleSource>"
                        << "</VRTRasterBand></VRTDataset>";
    return path;
  }
  static Result<std::shared_ptr<const DemSource>> open(const std::vector<std::string>& files,
                                                       DemOptions options = {}) {
    options.allow_vrt = true;
    return DemSource::open(files, options);
  }
  static double column_of(const DemSource& dem, Geographic place) {
    Vec2 post;
    dem.to_post({&place, 1}, {&post, 1});
    return post.x;
  }
};

TEST_F(DemPlaces, ARotationThatIsARoundingIsNone) {
  const auto dem = open({placed("a.vrt", "190, 0.01, 1e-18, 46, 1e-19, -0.01")});
  ASSERT_TRUE(dem) << dem.error().what;
  EXPECT_TRUE((*dem)->is_plain_geographic());
  for (const double lon : {190.015, -169.985})
    EXPECT_NEAR(column_of(**dem, {lon, 45.99}), 1, 1e-9) << lon;
}

TEST_F(DemPlaces, OneThatIsTurnedIsFollowedAroundTheGlobe) {
  const auto dem = open({placed("a.vrt", "190, 0.01, 0.001, 46, 0.001, -0.01")});
  ASSERT_TRUE(dem) << dem.error().what;
  for (const double lon : {190.0155, -169.9845})
    EXPECT_NEAR(column_of(**dem, {lon, 45.9965}), 1, 1e-6) << lon;
}

TEST_F(DemPlaces, SheetsThatAreTurnedByAQuarterAreOne) {
  const auto dem = open(
      {placed("a.vrt", "7, 0, 0.01, 46, 0.01, 0"), placed("b.vrt", "7, 0, 0.01, 46.04, 0.01, 0")});
  ASSERT_TRUE(dem) << dem.error().what;
  EXPECT_EQ((*dem)->info().cols, 8);
  EXPECT_EQ((*dem)->info().rows, 3);
}

TEST_F(DemPlaces, ASheetInAnotherWorldIsRefusedByItsName) {
  const std::string good = placed("a.vrt", "500000, 10, 0, 5000000, 0, -10", "EPSG:32632");
  for (const auto& [x, said] : {std::pair{"1e12", "posts apart"},
                                {"1e25", "posts apart"},
                                {"1e10", "lie outside of its CRS"}}) {
    const std::string far =
        placed("far.vrt", std::string(x) + ", 10, 0, 5000000, 0, -10", "EPSG:32632");
    const auto both = open({good, far});
    ASSERT_FALSE(both) << x;
    EXPECT_THAT(both.error().what, testing::AllOf(HasSubstr("far.vrt"), HasSubstr(said))) << x;
  }
}

TEST_F(DemPlaces, MetresThatAreCalledDegreesAreRefused) {
  for (const char* const at : {"0, 250, 0, 100, 0, -25",  // around the globe, and again
                               "5, 0.1, 0, 80, 0, -100",  // far beyond a pole
                               "0, 0, 50, 0, 60, 0"}) {   // turned by a quarter
    const auto dem = open({placed("a.vrt", at)});
    ASSERT_FALSE(dem) << at;
    EXPECT_EQ(dem.error().code, Errc::bad_data);
    EXPECT_THAT(dem.error().what, testing::AllOf(HasSubstr("coordinates run from"),
                                                 HasSubstr("say with --crs which one")));
  }
  const auto dem = open({placed("a.vrt", "-180, 130, 0, 90, 0, -60")});  // with columns twice
  EXPECT_TRUE(dem) << dem.error().what;
}

TEST_F(DemPlaces, WhatRowsBeyondAPoleHoldIsNothing) {
  // Rows at 100, 90 and 80 degrees.
  const std::string path = placed("a.vrt", "0, 10, 0, 105, 0, -10");
  DemOptions converted{.from_datum = VerticalDatum::egm96};
  converted.environment = test::environment();
  converted.to_datum.named = VerticalDatum::ellipsoid;
  for (const DemOptions& options : {DemOptions(), converted}) {
    const auto dem = open({path}, options);
    ASSERT_TRUE(dem) << dem.error().what;
    const auto grid = (*dem)->read(0, 0, 4, 3);
    ASSERT_TRUE(grid) << grid.error().what;  // no geoid reaches there
    EXPECT_TRUE(grid->is_void(0, 0));
    EXPECT_NEAR(grid->at(0, 2), 8, 100);
  }
}

TEST_F(DemPlaces, AMaskOfTheBandAloneCounts) {
  std::ofstream(folder_.file("mask.asc"))
      << "ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
         "255 255 0 0\n255 255 255 255\n255 255 255 255\n";
  const std::string mask =
      "<MaskBand><VRTRasterBand dataType=\"Byte\"><SimpleSource><SourceFilename "
      "relativeToVRT=\"1\">mask.asc</SourceFilename><SourceBand>1</SourceBand></SimpleSource>"
      "</VRTRasterBand></MaskBand>";
  const auto dem = open({placed("a.vrt", "7, 0.01, 0, 46, 0, -0.01", "EPSG:4326", mask)});
  ASSERT_TRUE(dem) << dem.error().what;
  const auto grid = (*dem)->read(0, 0, 4, 3);
  ASSERT_TRUE(grid) << grid.error().what;
  EXPECT_EQ(grid->at(1, 0), 1);
  EXPECT_TRUE(grid->is_void(2, 0));
  EXPECT_EQ(grid->at(2, 1), 6);
}

}  // namespace
}  // namespace tind
