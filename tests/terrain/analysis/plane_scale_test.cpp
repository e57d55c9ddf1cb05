#include "terrain/analysis/plane_scale.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/made_up_source.h"
#include "tests/support/projected_dem.h"
#include "tests/support/support.h"

namespace tind {
namespace {

class PlaneScale : public ::testing::Test {
 protected:
  const test::TempDir folder_;

  std::shared_ptr<const DemSource> open(const test::ProjectedDem& dem) const {
    auto source = test::open_projected(dem, folder_);
    EXPECT_TRUE(source) << dem.name;
    return source;
  }
};

constexpr double kRadians = 0.017453292519943295;

TEST_F(PlaneScale, OfAreasIsHowFarTheyAreFromTheGrounds) {
  const auto mercator = open({"merc", "EPSG:3857", 900000, 5942074, 1000, 20, 20});  // 47 degrees
  const AreaScale web = area_scale(*mercator, whole_area(mercator->info()));
  EXPECT_NEAR(web.least, 1 / std::pow(std::cos(46.92 * kRadians), 2), .02);
  EXPECT_GT(web.greatest, web.least);
  EXPECT_LT(web.greatest, web.least * 1.01);
  const auto utm = open({"utm", "EPSG:32632", 500000, 5200000, 1000, 20, 20});
  const AreaScale flat = area_scale(*utm, whole_area(utm->info()));
  EXPECT_NEAR(flat.least, .9996 * .9996, 1e-5);
  EXPECT_NEAR(flat.greatest, .9996 * .9996, 2e-5);
  const auto pole = open({"pole", "EPSG:3031", -10000, 10000, 1000, 21, 21});
  const AreaScale around = area_scale(*pole, whole_area(pole->info()));
  EXPECT_NEAR(around.least, .9728 * .9728, 1e-3) << "at a pole longitudes are nothing";
  EXPECT_NEAR(around.greatest, .9728 * .9728, 1e-3);
}

TEST_F(PlaneScale, OfLengthsIsTheSameInAllDirectionsWhereAnglesAreKept) {
  const auto mercator = open({"merc", "EPSG:3857", 900000, 5942074, 1000, 20, 20});
  const LengthScale web = length_scale(*mercator);
  EXPECT_NEAR(web.least, 1 / std::cos(46.92 * kRadians), .01);
  EXPECT_LT(web.greatest, web.least * 1.01);
  // Its formulas are those of a sphere, so that it is not quite so: by what the ellipsoid is flat.
  EXPECT_LT(web.uneven, 1.005);
  const LengthScale utm = length_scale(*open({"utm", "EPSG:32632", 500000, 5200000, 1000, 20, 20}));
  EXPECT_NEAR(utm.least, .9996, 1e-5);
  EXPECT_NEAR(utm.greatest, .9996, 1e-5);
  EXPECT_NEAR(utm.uneven, 1, 1e-5);
  const LengthScale pole = length_scale(*open({"pole", "EPSG:3031", -10000, 10000, 1000, 21, 21}));
  EXPECT_NEAR(pole.least, .9728, 1e-3);
  EXPECT_NEAR(pole.uneven, 1, 1e-4);
}

TEST_F(PlaneScale, OfLengthsKnowsThatOneDirectionIsStretched) {
  // Plate carree: degrees as metres of the equator.
  const auto dem = open({"plate", "EPSG:4087", 1000000, 5135000, 1000, 20, 20});
  const LengthScale scale = length_scale(*dem);
  EXPECT_NEAR(scale.greatest, 1 / std::cos(46.1 * kRadians), .01);
  EXPECT_NEAR(scale.least, 1, .01);
  EXPECT_NEAR(scale.uneven, scale.greatest / scale.least, .01);
}

TEST_F(PlaneScale, OfPostsFarApartIsThatOfTheirPlaces) {
  const auto world = open({"world", "EPSG:3857", -10000000, 8000000, 400000, 30, 30});
  const LengthScale scale = length_scale(*world);
  EXPECT_NEAR(scale.least, 1, .01);
  EXPECT_LT(scale.uneven, 1.01);
}

TEST_F(PlaneScale, OfDegreesIsOne) {
  const test::MadeUpSource dem(test::rough_terrain(5, 5, 1), {10, 50}, 0.001);
  EXPECT_EQ(area_scale(dem, whole_area(dem.info())).greatest, 1);
  EXPECT_EQ(length_scale(dem).greatest, 1);
  EXPECT_EQ(length_scale(dem).uneven, 1);
}

}  // namespace
}  // namespace tind
