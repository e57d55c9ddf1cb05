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
#include <initializer_list>
#include <iomanip>

#include "terrain/raster/dem_source.h"
#include "terrain/raster/gdal/crs/proj_datum.h"
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

TEST(DatumNames, OfAProjected3dCrsAreTheEllipsoidInMetres) {
  const auto known = [](const char* words) {
    return gdal::vertical_crs(std::string("+proj=") + words + " +type=crs");
  };
  const auto metres = known("utm +zone=32 +datum=WGS84 +vunits=m");
  ASSERT_TRUE(metres) << metres.error().what;
  EXPECT_TRUE(metres->ellipsoidal);
  for (const char* other :
       {"utm +zone=32 +ellps=bessel +vunits=m", "utm +zone=32 +datum=WGS84 +vunits=ft",
        "longlat +datum=WGS84 +vunits=ft"}) {
    const auto none = known(other);
    ASSERT_FALSE(none) << other;
    EXPECT_EQ(none.error().code, Errc::unsupported) << other;
  }
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

/// Greatest distance between PROJ's EGM96 by that name, on a DEM in that CRS, and the one that
/// comes along, over places in France and Germany.
double from_egm96(const std::string& name, const std::string& crs) {
  const auto surface = gdal::proj_surface(name, {3, 47, 10, 51}, crs);
  EXPECT_TRUE(surface) << surface.error().what;
  const auto egm96 = test::environment()->egm96();
  if (!surface || !egm96) return HUGE_VAL;
  double most = 0;
  for (double lon = 3.1; lon < 10; lon += 0.3)
    for (double lat = 47.1; lat < 51; lat += 0.3) {
      const Geographic place{lon, lat};
      double n = 0;
      (*surface)->undulations({&place, 1}, {&n, 1});
      most = std::fmax(most, std::isnan(n) ? HUGE_VAL : std::abs(n - (*egm96)->undulation(place)));
    }
  return most;
}

constexpr double kOfProj_m = 2e-3;  // between the two grids, as docs/dems.md says, and a rounding

/// Easting and northing, grads and degrees from Ferro were taken for degrees from Greenwich.
TEST_F(Datums, OfACompoundCrsTheHeightsCountAndNotTheUnitsOfItsPlaces) {
  for (const char* name :
       {"EPSG:4326+5773", "EPSG:32632+5773", "EPSG:3857+5773", "EPSG:4807+5773", "EPSG:4805+5773",
        "EPSG:27572+5773", "EPSG:25832+EPSG:5773", "WGS 84 / UTM zone 32N + EGM96 height"})
    for (const char* crs : {"", "EPSG:4326", "EPSG:32632", "EPSG:4807"})
      EXPECT_LT(from_egm96(name, crs), kOfProj_m) << name << " on " << crs;
}

TEST_F(Datums, OfADemThatCountsFromParisAreThoseOfItsPlaces) {
  for (const char* crs : {"EPSG:4807", "EPSG:27572", "EPSG:4805", "EPSG:2154", "EPSG:4326"})
    EXPECT_LT(from_egm96("EPSG:5773", crs), kOfProj_m) << crs;
}

/// 5 x 4 posts of 1000 m; the corner and the step are in units of the CRS.
std::string write_level_dem(const std::string& path, Vec2 corner, double step) {
  std::ofstream out(path);
  out << std::setprecision(12) << "ncols 5\nnrows 4\nxllcenter " << corner.x << "\nyllcenter "
      << corner.y << "\ncellsize " << step << '\n';
  for (int i = 0; i < 20; ++i) out << 1000 << (i % 5 == 4 ? '\n' : ' ');
  return path;
}

TEST_F(Datums, OfADemAreTheSameByTheCompoundCrsAndItsVerticalPart) {
  const struct {
    const char *crs, *datum;
    Vec2 corner;
    double step;
  } cases[] = {{"EPSG:32632", "EPSG:32632+5773", {500000, 5200000}, 30},
               {"EPSG:3857", "EPSG:3857+5773", {780000, 5980000}, 30},
               {"EPSG:4807", "EPSG:4807+5773", {2, 50}, 0.01}};
  options_.environment = test::environment();
  for (const auto& [crs, datum, corner, step] : cases) {
    const std::string path = write_level_dem(folder_.file("c.asc"), corner, step);
    options_.crs = crs;
    const auto alone = open(path, "EPSG:5773", "ellipsoid"),
               compound = open(path, datum, "ellipsoid");
    ASSERT_TRUE(alone) << alone.error().what;
    ASSERT_TRUE(compound) << compound.error().what;
    EXPECT_EQ(name((*compound)->info().source_datum), datum);
    const auto a = (*alone)->read(0, 0, 5, 4), b = (*compound)->read(0, 0, 5, 4);
    ASSERT_TRUE(a && b) << datum;
    for (int i = 0; i < 20; ++i)
      EXPECT_NEAR(a->values()[std::size_t(i)], b->values()[std::size_t(i)], 2 * kOfProj_m) << datum;
  }
}

/// UTM zone 32 with heights: `up` is the third axis, e.g. up,LENGTHUNIT["metre",1].
std::string utm_with_heights(const std::string& datum, const std::string& up) {
  return R"(PROJCRS["utm",BASEGEOGCRS["b",DATUM[)" + datum +
         R"(]],CONVERSION["c",METHOD["Transverse Mercator"],)"
         R"(PARAMETER["Latitude of natural origin",0,ANGLEUNIT["degree",0.0174532925199433]],)"
         R"(PARAMETER["Longitude of natural origin",9,ANGLEUNIT["degree",0.0174532925199433]],)"
         R"(PARAMETER["Scale factor at natural origin",0.9996,SCALEUNIT["unity",1]],)"
         R"(PARAMETER["False easting",500000,LENGTHUNIT["metre",1]],)"
         R"(PARAMETER["False northing",0,LENGTHUNIT["metre",1]]],CS[Cartesian,3],)"
         R"(AXIS["e",east,LENGTHUNIT["metre",1]],AXIS["n",north,LENGTHUNIT["metre",1]],)"
         R"(AXIS["h",)" +
         up + "]]";
}

TEST_F(Datums, HeightsOfAProjected3dCrsAreAboveItsEllipsoidInItsUnit) {
  const std::string path = write_level_dem(folder_.file("e.asc"), {500000, 5200000}, 30);
  const std::string wgs84 =
                        R"("World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563])",
                    bessel = R"("CH1903+",ELLIPSOID["Bessel 1841",6377397.155,299.1528128])",
                    metres = R"(up,LENGTHUNIT["metre",1])",
                    feet = R"(up,LENGTHUNIT["foot",0.3048])";
  const auto read = [&](const std::string& crs) {
    DemOptions options;
    options.crs = crs;
    return DemSource::open({&path, 1}, options);
  };
  const auto plain = read(utm_with_heights(wgs84, metres));
  ASSERT_TRUE(plain) << plain.error().what;
  EXPECT_EQ((*plain)->info().datum, VerticalDatum::ellipsoid);
  EXPECT_EQ((*plain)->info().crs_kind, CrsKind::projected);
  EXPECT_EQ((*plain)->read(0, 0, 1, 1)->at(0, 0), 1000);
  EXPECT_THAT((*plain)->info().crs_wkt, testing::Not(HasSubstr("Cartesian,3")));
  const auto in_feet = read(utm_with_heights(wgs84, feet));
  ASSERT_TRUE(in_feet) << in_feet.error().what;
  EXPECT_EQ((*in_feet)->info().datum, VerticalDatum::ellipsoid);
  EXPECT_NEAR((*in_feet)->read(0, 0, 1, 1)->at(0, 0), 304.8, 1e-3);
  const auto other = read(utm_with_heights(bessel, metres));
  ASSERT_TRUE(other) << other.error().what;
  EXPECT_EQ((*other)->info().datum, VerticalDatum::unknown);
  EXPECT_EQ(read(utm_with_heights(wgs84, R"(down,LENGTHUNIT["metre",1])")).error().code,
            Errc::invalid_argument)
      << "depths";
}

/// A GeoTIFF of 2 x 2 posts of 1000 m, 30 m apart, whose keys are codes of a projected CRS and of
/// what its heights are in.
std::string write_geotiff(const std::string& path, int projected, int vertical) {
  const auto two = [](std::string& to, int n) { to += char(n >> 8), to += char(n & 255); };
  const auto doubles = [](std::initializer_list<double> numbers) {
    std::string bytes;
    for (const double number : numbers) put_big(bytes, number);
    return bytes;
  };
  std::string keys;
  for (const int n :
       {1, 1, 1, 4, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, projected, 4096, 0, 1, vertical})
    two(keys, n);
  constexpr int kShort = 3, kLong = 4, kDouble = 12, kEntries = 13;
  std::string head = "MM", behind;
  two(head, 42), put_big(head, std::int32_t(8)), two(head, kEntries);
  const auto number = [&](int tag, int type, int value) {
    two(head, tag), two(head, type), put_big(head, std::int32_t(1));
    if (type == kLong) return put_big(head, std::int32_t(value));
    two(head, value), two(head, 0);
  };
  const auto put = [&](int tag, int type, int count, const std::string& bytes) {
    two(head, tag), two(head, type), put_big(head, std::int32_t(count));
    put_big(head, std::int32_t(8 + 2 + 12 * kEntries + 4 + behind.size()));
    behind += bytes;
  };
  for (int i = 0; i < 4; ++i) put_big(behind, 1000.F);
  number(256, kShort, 2), number(257, kShort, 2), number(258, kShort, 32);
  number(259, kShort, 1), number(262, kShort, 1);
  number(273, kLong, 8 + 2 + 12 * kEntries + 4);  // the posts come first behind
  number(277, kShort, 1), number(278, kShort, 2), number(279, kLong, 16), number(339, kShort, 3);
  put(33550, kDouble, 3, doubles({30, 30, 0}));
  put(33922, kDouble, 6, doubles({0, 0, 0, 500000, 5200000, 0}));
  put(34735, kShort, 20, keys);
  put_big(head, std::int32_t(0));
  std::ofstream(path, std::ios::binary) << head << behind;
  return path;
}

TEST_F(Datums, AGeoTiffOfAProjected3dCrsIsAboveTheEllipsoid) {
  const std::string path = write_geotiff(folder_.file("p.tif"), 32632, 4979);
  DemOptions options;
  options.environment = test::environment();
  const auto plain = DemSource::open({&path, 1}, options);
  ASSERT_TRUE(plain) << plain.error().what;
  EXPECT_EQ((*plain)->info().datum, VerticalDatum::ellipsoid);
  EXPECT_EQ((*plain)->info().crs_name, "WGS 84 / UTM zone 32N");
  options.to_datum = TargetDatum(VerticalDatum::egm96);
  const auto below = DemSource::open({&path, 1}, options);
  ASSERT_TRUE(below) << below.error().what;
  const auto egm96 = test::environment()->egm96();
  const Vec2 post{0, 0};
  Geographic place;
  (*below)->to_geographic({&post, 1}, {&place, 1});
  EXPECT_NEAR((*below)->read(0, 0, 1, 1)->at(0, 0), 1000 - (*egm96)->undulation(place), 2e-3);
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
