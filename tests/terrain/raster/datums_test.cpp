// Vertical datums with grids of hand-computed values. Nothing here needs a grid that is not made
// here, except for the EGM96 that comes along.

#include "terrain/raster/datums.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>

#include "terrain/raster/dem_source.h"
#include "tests/support/geoid_file.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

using Surface = test::GeoidHeights;
using test::put_big;
using test::write_gtx;

/// A grid as GeographicLib reads it: nodes every 10 degrees of the globe, in steps of 1 cm.
std::string write_pgm(const std::string& path, const Surface& n) {
  std::string bytes =
      "P5\n# Geoid file in PGM format for the GeographicLib::Geoid class\n# Description synthetic\n"
      "# DateTime 2000-01-01 00:00:00\n# MaxBilinearError 0\n# RMSBilinearError 0\n"
      "# MaxCubicError 0\n# RMSCubicError 0\n# Offset -108\n# Scale 0.01\n# Origin 90N 0E\n"
      "# AREA_OR_POINT Point\n# Vertical_Datum WGS84\n36 19\n65535\n";
  for (int r = 0; r < 19; ++r)
    for (int c = 0; c < 36; ++c) {
      const auto count = std::uint16_t(std::lround((n(10.0 * c, 90 - 10.0 * r) + 108) / 0.01));
      bytes += char(count >> 8), bytes += char(count & 255);
    }
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

double bilinear(double lon, double lat) { return 20 + 3 * lon - 0.5 * lat + 0.25 * lon * lat; }
double by_latitude(double, double lat) { return 10 + 0.5 * lat; }

/// Sets a variable of the environment as long as it lives.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    setenv(name, value.c_str(), 1);
  }
  ~Variable() { unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
};

class Datums : public testing::Test {
 protected:
  /// 5 x 4 posts of 1000 m, a quarter degree apart from 7.1 east, 46.9 north; one is a void.
  std::string dem(const std::string& crs = "", double west = 7.1) {
    std::ofstream out(folder_.file("d.asc"));
    out << "ncols 5\nnrows 4\nxllcenter " << west << "\nyllcenter 46.15\ncellsize 0.25\n"
        << "NODATA_value -9999\n";
    for (int i = 0; i < 20; ++i) out << (i == 7 ? -9999 : 1000) << (i % 5 == 4 ? '\n' : ' ');
    options_.crs = crs.empty() ? "EPSG:4326" : crs;
    options_.environment = test::environment();
    return folder_.file("d.asc");
  }
  Result<std::shared_ptr<const DemSource>> open(const std::string& path, const char* from,
                                                const std::string& to) {
    DemOptions options = options_;
    options.from_datum = *datum_named(from);
    if (!to.empty()) options.to_datum = TargetDatum(*datum_named(to));
    return DemSource::open({&path, 1}, options);
  }
  /// All posts of the source are 1000 m and `shift` of their place; to the rounding.
  void expect_shift(const DemSource& source, const Surface& shift) {
    const auto grid = source.read(0, 0, 5, 4);
    ASSERT_TRUE(grid) << grid.error().what;
    for (int r = 0; r < 4; ++r)
      for (int c = 0; c < 5; ++c) {
        if (r == 1 && c == 2) {
          EXPECT_TRUE(grid->is_void(c, r));
          continue;
        }
        EXPECT_NEAR(grid->at(c, r), 1000 + shift(7.1 + 0.25 * c, 46.9 - 0.25 * r),
                    source.info().rounding_m + 1e-4);
      }
  }
  test::TempDir folder_;
  DemOptions options_;
};

TEST(DatumNames, AreWhatOutputsSay) {
  for (const char* word : {"unknown", "ellipsoid", "egm84", "egm96", "egm2008", "EPSG:5703"})
    EXPECT_EQ(name(*datum_named(word)), word);
  EXPECT_EQ(name(*datum_named("egm2008-2_5")), "egm2008");
  EXPECT_EQ(*datum_named("egm96-5"), VerticalDatum::egm96);
  EXPECT_EQ(*datum_named("EGM2008"), VerticalDatum::egm2008);
  EXPECT_EQ(*datum_named("Ellipsoid"), VerticalDatum::ellipsoid);
  EXPECT_EQ(*datum_named("EPSG:5773"), VerticalDatum::egm96);
  EXPECT_EQ(*datum_named("EPSG:3855"), VerticalDatum::egm2008);
  EXPECT_EQ(*datum_named("EPSG:4979"), VerticalDatum::ellipsoid);
  EXPECT_EQ(name(*datum_named("EPSG:4269+5703")), "EPSG:4269+5703");
  for (const char* none :
       {"", "egm", "egm2008-7", "EPSG:4326", "EPSG:999999", "EPSG:5715", "x.txt"})
    EXPECT_EQ(datum_named(none).error().code, Errc::invalid_argument) << none;
  EXPECT_EQ(datum_named("none.gtx").error().code, Errc::not_found);
  // Heights above WGS 72's ellipsoid are 2 to 3 m off WGS84's; above GRS80's they are the same.
  EXPECT_EQ(datum_named("EPSG:4985").error().code, Errc::unsupported);
  EXPECT_EQ(*datum_named("EPSG:4937"), VerticalDatum::ellipsoid);
}

TEST_F(Datums, HeightsAboveAnotherEllipsoidAreNotTakenForThoseAboveWgs84s) {
  const auto datum_of = [&](const char* crs) {
    std::ofstream(folder_.file("e.asc")) << "ncols 2\nnrows 2\nxllcenter 7\nyllcenter 46\n"
                                            "cellsize 0.01\n1 2\n3 4\n";
    DemOptions options;
    options.crs = crs;
    const std::string path = folder_.file("e.asc");
    const auto source = DemSource::open({&path, 1}, options);
    EXPECT_TRUE(source) << source.error().what;
    return source ? (*source)->info().datum : VerticalDatum(VerticalDatum::file);
  };
  EXPECT_EQ(datum_of("EPSG:4979"), VerticalDatum::ellipsoid);
  EXPECT_EQ(datum_of("EPSG:4937"), VerticalDatum::ellipsoid) << "ETRS89";
  EXPECT_EQ(datum_of("EPSG:4985"), VerticalDatum::unknown) << "WGS 72";
}

TEST_F(Datums, OfPostsBesideTheAntimeridianAreThoseOfTheirPlaces) {
  // An undulation that is 50 m higher on the other side of the globe; 21 posts of another datum
  // than WGS84, the last one at 180.
  const std::string geoid = write_pgm(
      folder_.file("g.pgm"), [](double lon, double) { return std::abs(lon - 180) < 95 ? 10 : 60; });
  std::ofstream(folder_.file("d.prj"))
      << "GEOGCS[\"NAD83\",DATUM[\"North_American_Datum_1983\",SPHEROID[\"GRS 1980\",6378137,"
         "298.257222101]],PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]";
  for (const int posts : {21, 22, 27}) {
    std::ofstream out(folder_.file("d.asc"));
    out << "ncols " << posts << "\nnrows 9\nxllcenter " << 180 - (posts - 1) * .0005
        << "\nyllcenter 46\ncellsize 0.0005\n";
    for (int i = 0; i < 9 * posts; ++i) out << 100 << (i % posts == posts - 1 ? '\n' : ' ');
    out.close();
    DemOptions options;
    options.from_datum = *datum_named(geoid);
    options.to_datum = TargetDatum(*datum_named("ellipsoid"));
    options.environment = test::environment();
    const std::string path = folder_.file("d.asc");
    const auto source = DemSource::open({&path, 1}, options);
    ASSERT_TRUE(source) << source.error().what;
    const auto all = (*source)->read(0, 0, posts, 9);
    ASSERT_TRUE(all) << all.error().what;
    for (const float z : all->values()) ASSERT_NEAR(z, 110, .02) << posts;
  }
}

TEST_F(Datums, AFileAsProjHasIt) {
  const std::string gtx = write_gtx(folder_.file("b.gtx"), bilinear), path = dem();
  const auto up = open(path, gtx.c_str(), "ellipsoid");
  ASSERT_TRUE(up) << up.error().what;
  expect_shift(**up, bilinear);
  EXPECT_EQ((*up)->info().datum, VerticalDatum::ellipsoid);
  EXPECT_EQ(name((*up)->info().source_datum), "b.gtx");
  EXPECT_EQ((*up)->info().datum_way, "b.gtx, bilinear");
  const auto down = open(path, "ellipsoid", gtx);
  ASSERT_TRUE(down) << down.error().what;
  expect_shift(**down, [](double lon, double lat) { return -bilinear(lon, lat); });
  EXPECT_EQ(name((*down)->info().datum), "b.gtx");
  const auto same = open(path, gtx.c_str(), gtx);
  ASSERT_TRUE(same);
  EXPECT_EQ((*same)->read(0, 0, 1, 1)->at(0, 0), 1000);
}

TEST_F(Datums, AFileAsGeographicLibHasIt) {
  const std::string pgm = write_pgm(folder_.file("plane.pgm"), by_latitude), path = dem();
  const auto up = open(path, pgm.c_str(), "ellipsoid");
  ASSERT_TRUE(up) << up.error().what;
  expect_shift(**up, by_latitude);
  EXPECT_EQ((*up)->info().datum_way, "plane.pgm, cubic");
  const std::string gtx = write_gtx(folder_.file("b.gtx"), bilinear);
  const auto across = open(path, pgm.c_str(), gtx);
  ASSERT_TRUE(across) << across.error().what;
  expect_shift(**across,
               [](double lon, double lat) { return by_latitude(lon, lat) - bilinear(lon, lat); });
  EXPECT_NE((*across)->info().fingerprint, (*up)->info().fingerprint);
}

TEST_F(Datums, Egm2008IsLookedForWhereGeographicLibHasIt) {
  const std::string path = dem();
  {
    const auto missing = open(path, "egm2008", "ellipsoid");
    ASSERT_FALSE(missing) << "this machine has a grid of EGM2008";
    EXPECT_EQ(missing.error().code, Errc::not_found);
    EXPECT_THAT(missing.error().what,
                AllOf(HasSubstr("egm2008-1.pgm"), HasSubstr("geographiclib-get-geoids"),
                      HasSubstr("us_nga_egm08_25.tif"), HasSubstr("https://cdn.proj.org/")));
    EXPECT_EQ(open(path, "egm2008-5", "ellipsoid").error().code, Errc::not_found);
  }
  write_pgm(folder_.file("egm2008-5.pgm"), by_latitude);
  const Variable folder("GEOGRAPHICLIB_GEOID_PATH", folder_.path().string());
  const auto found = open(path, "egm2008", "ellipsoid");
  ASSERT_TRUE(found) << found.error().what;
  expect_shift(**found, by_latitude);
  EXPECT_EQ((*found)->info().datum_way, "egm2008-5.pgm, cubic");
  const auto egm96 = test::environment()->egm96();
  const auto to96 = open(path, "egm2008", "egm96");
  ASSERT_TRUE(to96) << to96.error().what;
  expect_shift(**to96, [&](double lon, double lat) {
    return by_latitude(lon, lat) - (*egm96)->undulation({lon, lat});
  });
  EXPECT_EQ((*to96)->info().datum, VerticalDatum::egm96);
}

/// NAVD88 by the name under which PROJ's database has its grid, with other heights in it.
TEST_F(Datums, AVerticalCrsThroughTheGridThatProjNames) {
  const std::string path = dem("EPSG:6318");
  {
    const auto elsewhere = open(path, "EPSG:5703", "ellipsoid");
    ASSERT_FALSE(elsewhere) << "in Switzerland";
    EXPECT_EQ(elsewhere.error().code, Errc::unsupported);
    EXPECT_THAT(elsewhere.error().what, AllOf(HasSubstr("NAVD88"), HasSubstr("d.asc")));
  }
  // The ways of PROJ are those of an area; this one lies in Washington.
  std::string bytes;
  for (const double number : {40.0, -125.0, 1.0, 1.0}) put_big(bytes, number);
  put_big(bytes, std::int32_t(10)), put_big(bytes, std::int32_t(10));
  for (int i = 0; i < 100; ++i) put_big(bytes, float(-20 - (i / 10) + 0.5 * (i % 10)));
  std::ofstream(folder_.file("g2018u0.gtx"), std::ios::binary) << bytes;
  const std::string west = dem("EPSG:6318", -121.5);
  const auto missing = open(west, "EPSG:5703", "ellipsoid");
  ASSERT_FALSE(missing) << "this machine has a grid of NAVD88";
  EXPECT_EQ(missing.error().code, Errc::not_found);
  EXPECT_THAT(missing.error().what,
              AllOf(HasSubstr("us_noaa_g2018u0.tif"), HasSubstr("https://cdn.proj.org/")));
  const Variable folders("PROJ_DATA", folder_.path().string() + ":/usr/share/proj");
  const auto found = open(west, "EPSG:5703", "ellipsoid");
  ASSERT_TRUE(found) << found.error().what;
  // -20 - (lat - 40) + 0.5 (lon + 125), 6.9 and 3.5 degrees from the grid's corner.
  EXPECT_NEAR((*found)->read(0, 0, 1, 1)->at(0, 0), 1000 - 20 - 6.9 + 1.75, 1e-3);
  EXPECT_NEAR((*found)->read(4, 3, 1, 1)->at(0, 0), 1000 - 20 - 6.15 + 2.25, 1e-3);
  EXPECT_EQ(name((*found)->info().source_datum), "EPSG:5703");
  const auto compound = open(west, "EPSG:6318+5703", "ellipsoid");
  ASSERT_TRUE(compound) << compound.error().what;
  EXPECT_EQ((*compound)->read(4, 3, 1, 1)->at(0, 0), (*found)->read(4, 3, 1, 1)->at(0, 0));
  // In feet above the same zero: 1000 US survey feet are 304.8006 m.
  const auto feet = open(west, "EPSG:6360", "ellipsoid");
  ASSERT_TRUE(feet) << feet.error().what;
  EXPECT_NEAR((*feet)->read(0, 0, 1, 1)->at(0, 0), 304.8006 - 20 - 6.9 + 1.75, 2e-3);
  EXPECT_THAT((*found)->info().datum_way, HasSubstr("us_noaa_g2018u0.tif"));
}

TEST_F(Datums, APostBeyondTheGridIsAnError) {
  const std::string gtx = write_gtx(folder_.file("b.gtx"), bilinear), path = dem("", 9.6);
  const auto source = open(path, gtx.c_str(), "ellipsoid");
  ASSERT_TRUE(source) << source.error().what;
  EXPECT_THAT((*source)->info().warnings, testing::ElementsAre(HasSubstr("b.gtx")));
  EXPECT_EQ((*source)->read(0, 0, 5, 4).error().code, Errc::out_of_range);
  EXPECT_TRUE((*source)->read_decimated(1, 0, 1, 1, 100));
  EXPECT_TRUE((*source)->read_decimated(2, 1, 1, 1, 100)) << "a void needs no grid";
  const auto beyond = (*source)->read_decimated(3, 0, 1, 1, 100);
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().code, Errc::out_of_range);
  EXPECT_THAT(beyond.error().what, AllOf(HasSubstr("b.gtx"), HasSubstr("10.35")));
}

TEST_F(Datums, GridsThatAreNone) {
  const std::string path = dem();
  for (const char* grid : {"n.gtx", "n.pgm", "n.tif"}) {
    std::ofstream(folder_.file(grid)) << "not a grid at all, whatever its name says";
    const auto source = open(path, folder_.file(grid).c_str(), "ellipsoid");
    ASSERT_FALSE(source) << grid;
    EXPECT_EQ(source.error().code, Errc::bad_data);
    EXPECT_THAT(source.error().what, HasSubstr(grid));
  }
}

/// A GeoTIFF of one value, 6..10 east, 45..48 north; `type`: what PROJ's grids say that they are.
std::string write_tif(const std::string& path, double value, const std::string& type = "") {
  const std::string script =
      "/usr/bin/python3 -c \"from osgeo import gdal, osr; s = osr.SpatialReference(); "
      "s.ImportFromEPSG(4326); d = gdal.GetDriverByName('GTiff').Create('" +
      path + "', 40, 30, 1, gdal.GDT_Float32); d.SetGeoTransform([6, 0.1, 0, 48, 0, -0.1]); " +
      "d.SetProjection(s.ExportToWkt()); d.GetRasterBand(1).Fill(" + std::to_string(value) + "); " +
      (type.empty() ? "" : "d.SetMetadataItem('TYPE', '" + type + "')") + "\"";
  EXPECT_EQ(std::system(script.c_str()), 0);
  return path;
}

TEST_F(Datums, ADemIsNoGeoid) {
  const std::string path = dem();
  const auto told = [&](const std::string& grid) {
    const auto source = open(path, grid.c_str(), "ellipsoid");
    EXPECT_EQ(source ? Errc::internal : source.error().code, Errc::bad_data);
    return source ? "taken" : source.error().what;
  };
  EXPECT_THAT(told(write_gtx(folder_.file("h.gtx"), [](double lon, double) { return 50 * lon; })),
              AllOf(HasSubstr("h.gtx"), HasSubstr("500"), HasSubstr("no geoid")));
  EXPECT_THAT(told(write_tif(folder_.file("h.tif"), 900)),
              AllOf(HasSubstr("h.tif"), HasSubstr("900"), HasSubstr("no geoid")));
  EXPECT_THAT(told(write_tif(folder_.file("s.tif"), 3, "VERTICAL_OFFSET_VERTICAL_TO_VERTICAL")),
              AllOf(HasSubstr("s.tif"), HasSubstr("VERTICAL_TO_VERTICAL")));
  const auto none = [](double lon, double) { return lon > 9 ? -2147479936.0 : 7; };
  EXPECT_TRUE(open(path, write_gtx(folder_.file("n.gtx"), none).c_str(), "ellipsoid"))
      << "PROJ takes such values for nodata";
  EXPECT_TRUE(open(path, write_tif(folder_.file("g.tif"), -106).c_str(), "ellipsoid"));
  EXPECT_TRUE(open(
      path, write_tif(folder_.file("o.tif"), 300, "VERTICAL_OFFSET_GEOGRAPHIC_TO_VERTICAL").c_str(),
      "ellipsoid"))
      << "of another body, say: it says what it is";
}

TEST_F(Datums, WhatTheFileSaysIsNotPassedOver) {
  const std::string path = dem("EPSG:4326+3855");
  const auto plain = DemSource::open({&path, 1}, options_);
  EXPECT_EQ((*plain)->info().datum, VerticalDatum::egm2008);
  const auto said = open(path, "egm96", "ellipsoid");
  ASSERT_TRUE(said) << said.error().what;
  EXPECT_THAT((*said)->info().warnings,
              testing::ElementsAre(AllOf(HasSubstr("EGM2008 height"), HasSubstr("above egm96"))));
  // As a wish: the grid is missing, which is said, and the heights stay what they are.
  DemOptions wish = options_;
  wish.to_datum = TargetDatum::ellipsoid_if_known;
  const auto stays = DemSource::open({&path, 1}, wish);
  ASSERT_TRUE(stays) << stays.error().what;
  EXPECT_EQ((*stays)->info().datum, VerticalDatum::egm2008);
  EXPECT_THAT((*stays)->info().warnings, testing::ElementsAre(HasSubstr("egm2008-1.pgm")));
  EXPECT_EQ((*stays)->read(0, 0, 1, 1)->at(0, 0), 1000);
}

TEST_F(Datums, AHorizontalShiftWithoutItsGridIsSaid) {
  const std::string path = dem("EPSG:4267", -121.5);  // NAD27
  const auto source = DemSource::open({&path, 1}, options_);
  ASSERT_TRUE(source) << source.error().what;
  const DemInfo& info = (*source)->info();
  ASSERT_TRUE(info.crs_accuracy_m);
  EXPECT_GT(*info.crs_accuracy_m, 1);
  EXPECT_THAT(info.crs_way, HasSubstr("NAD27"));
  EXPECT_THAT(info.warnings,
              testing::ElementsAre(AllOf(HasSubstr("d.asc"), HasSubstr("misses the grid"),
                                         HasSubstr("https://cdn.proj.org/"))));
  const std::string plain = dem("EPSG:32610", -121.5);
  EXPECT_EQ((*DemSource::open({&plain, 1}, options_))->info().crs_accuracy_m, 0);
  EXPECT_THAT((*DemSource::open({&plain, 1}, options_))->info().warnings, IsEmpty());
}

}  // namespace
}  // namespace tind
