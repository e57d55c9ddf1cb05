// Several files as one array; heights at places, across seams and beside voids.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <fstream>
#include <random>
#include <thread>

#include "terrain/geo/geoid.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/interpolate.h"
#include "terrain/raster/nodata.h"
#include "tests/support/srtm.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

Result<std::shared_ptr<const DemSource>> open(std::vector<std::string> files,
                                              const DemOptions& options = {}) {
  return DemSource::open(files, options);
}

std::shared_ptr<const DemSource> must_open(std::vector<std::string> files,
                                           DemOptions options = {}) {
  options.environment = test::environment();
  auto source = open(std::move(files), options);
  EXPECT_TRUE(source.has_value()) << (source ? "" : source.error().what);
  return source ? *source : nullptr;
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

class SmallGrids : public testing::Test {
 protected:
  /// An ASCII grid drawn as text; x, y of its south-western post.
  std::string grid(const std::string& drawing, double x = 0, double y = 0, double step = 1) {
    const HeightGrid heights = test::grid_from(drawing);
    const std::string path = folder_.file("grid" + std::to_string(++count_) + ".asc");
    std::ofstream out(path);
    out.precision(17);
    out << "ncols " << heights.cols() << "\nnrows " << heights.rows() << "\nxllcenter " << x
        << "\nyllcenter " << y << "\ncellsize " << step << "\nNODATA_value -9999\n";
    for (int r = 0; r < heights.rows(); ++r) {
      for (const float z : heights.row(r)) out << (std::isnan(z) ? -9999 : z) << ' ';
      out << '\n';
    }
    return path;
  }
  std::string geographic(const std::string& drawing, double x = 0, double y = 0, double step = 1) {
    const std::string path = grid(drawing, x, y, step);
    std::ofstream(path.substr(0, path.size() - 3) + "prj")
        << "GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137,"
           "298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"Degree\",0.017453292519943295]]";
    return path;
  }
  test::TempDir folder_;
  int count_ = 0;
};

void expect_heights(const DemSource& source, const std::string& drawing) {
  const HeightGrid want = test::grid_from(drawing);
  ASSERT_EQ(source.info().cols, want.cols());
  ASSERT_EQ(source.info().rows, want.rows());
  const auto got = source.read(0, 0, want.cols(), want.rows());
  ASSERT_TRUE(got) << got.error().what;
  for (int r = 0; r < want.rows(); ++r)
    for (int c = 0; c < want.cols(); ++c) {
      if (want.is_void(c, r))
        EXPECT_TRUE(got->is_void(c, r)) << c << " " << r;
      else
        EXPECT_EQ(got->at(c, r), want.at(c, r)) << c << " " << r;
    }
}

TEST_F(SmallGrids, FirstValidPostWins) {
  const auto a = grid("1 2 . / 4 5 6"), b = grid("7 8 9 / . 10 11", 2, 0), c = grid("12 13", 0, -2);
  const auto source = must_open({a, b, c});
  ASSERT_TRUE(source);
  expect_heights(*source, "1 2 7 8 9 / 4 5 6 10 11 / . . . . . / 12 13 . . .");
  expect_heights(*must_open({b, a}), "1 2 7 8 9 / 4 5 6 10 11");
}

TEST_F(SmallGrids, SparseReadsSeeTheSamePosts) {
  const auto a = grid("1 2 . / 4 5 6"), b = grid("7 8 9 / . 10 11", 2, 0);
  const auto source = must_open({a, b});
  const auto far = source->read_decimated(2 - 64, 0, 3, 2, 64);
  ASSERT_TRUE(far);
  EXPECT_EQ(far->at(1, 0), 7);
  EXPECT_TRUE(far->is_void(0, 0) && far->is_void(2, 0) && far->is_void(1, 1));
  EXPECT_TRUE(source->read_decimated(0, 1, 1, 1, 100)->at(0, 0) == 4);
  EXPECT_EQ(source->read_decimated(2, 1, 1, 1, 100)->at(0, 0), 6);
}

TEST_F(SmallGrids, WhatClosesAGlobeIsReadWhereNoOtherFileIs) {
  // Steps of 60 degrees: posts at -180 and 180 are one, and in the southern row only the eastern
  // file has it.
  const auto source =
      must_open({geographic("8 9 1 2 3 4", -180, 60, 60), geographic("5 6 7", 60, 0, 60)});
  ASSERT_TRUE(source->info().wraps_longitude);
  ASSERT_EQ(source->info().cols, 7);
  const auto row = source->read(-1, 1, 4, 1);
  ASSERT_TRUE(row);
  EXPECT_EQ(row->at(0, 0), 6);
  EXPECT_EQ(row->at(1, 0), 7);
  EXPECT_TRUE(row->is_void(2, 0));
  EXPECT_EQ(source->read(6, 0, 1, 1)->at(0, 0), 8);
  // A void in the west is filled by the column that comes again in the east, never the other way.
  const auto closed = must_open({geographic(". 1 2 3 4 5 7", -180, 0, 60)});
  ASSERT_TRUE(closed->info().wraps_longitude);
  EXPECT_EQ(closed->read(0, 0, 1, 1)->at(0, 0), 7);
  const auto west = must_open({geographic("8 1 2 3 4 5 7", -180, 0, 60)});
  EXPECT_EQ(west->read(6, 0, 1, 1)->at(0, 0), 8);
}

TEST_F(SmallGrids, APoleIsAQuarterOfATurnInAnyUnit) {
  const std::string path = grid("1 2 / 3 4 / 5 6", 10, 88, 6);
  std::ofstream(path.substr(0, path.size() - 3) + "prj")
      << "GEOGCS[\"grads\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137,298.257223563]],"
         "PRIMEM[\"Greenwich\",0],UNIT[\"grad\",0.01570796326794897]]";
  const auto source = must_open({path});
  const auto all = source->read(0, 0, 2, 3);
  ASSERT_TRUE(all);
  EXPECT_THAT(all->values(), testing::ElementsAre(1, 2, 3, 4, 5, 6));  // 100, 94 and 88 grads
}

/// Reads windows all around a globe of 600 columns, three blocks, with a void in every 50th. The
/// grid may have more columns than that: those past 600 are the first ones again, whatever it says.
void expect_a_globe(const DemSource& source) {
  std::mt19937 random(1);
  for (int k = 0; k < 200; ++k) {
    const int step = 1 + int(random() % 9), cols = 1 + int(random() % 700);
    const int col = int(random() % 2400) - 1200, row = int(random() % 5) - 1;
    const auto part = source.read_decimated(col, row, cols, 3, step);
    ASSERT_TRUE(part);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < cols; ++c) {
        const int x = ((col + c * step) % 600 + 600) % 600, y = row + r * step;
        if (y < 0 || y > 2 || x % 50 == 7)
          ASSERT_TRUE(part->is_void(c, r)) << x << ' ' << y;
        else
          ASSERT_EQ(part->at(c, r), float(x + 1000 * y)) << x << ' ' << y;
      }
  }
}

TEST_F(SmallGrids, AroundTheGlobeAnyWindowSeesThePostsOfItsColumns) {
  for (const int cols : {600, 601, 603}) {
    SCOPED_TRACE(cols);
    std::string drawing;
    for (int r = 0; r < 3; ++r) {
      if (r > 0) drawing += "/ ";
      for (int c = 0; c < cols; ++c)
        drawing += c % 50 == 7 ? std::string(". ") : std::to_string(c + 1000 * r) + " ";
    }
    const auto source = must_open({geographic(drawing, -180, 0, 0.6)});
    ASSERT_TRUE(source);
    ASSERT_TRUE(source->info().wraps_longitude);
    expect_a_globe(*source);
  }
}

TEST_F(SmallGrids, FilesInAnyPlaceOrOrder) {
  const auto a = grid("1 2 / 3 4", 10, 10), b = grid("5 6 / 7 8", 8, 12);
  expect_heights(*must_open({a, b}), "5 6 . . / 7 8 . . / . . 1 2 / . . 3 4");
  const Affine map = must_open({a, b})->info().post_to_crs;
  EXPECT_EQ(map.apply(0, 0), (Vec2{8, 13}));
  EXPECT_EQ(map.apply(3, 3), (Vec2{11, 10}));
}

TEST_F(SmallGrids, OtherGridsAreRefusedByName) {
  const auto a = grid("1 2 / 3 4"), shifted = grid("1 2 / 3 4", 2.3, 0),
             coarse = grid("1 2 / 3 4", 2, 0, 2), placed = geographic("1 2 / 3 4", 2, 0);
  for (const auto& [other, why] :
       {std::pair{shifted, "part of a post"}, {coarse, "spacings"}, {placed, "CRSs differ"}}) {
    const auto both = open({a, other});
    ASSERT_FALSE(both);
    EXPECT_EQ(both.error().code, Errc::unsupported);
    EXPECT_THAT(both.error().what, HasSubstr(a));
    EXPECT_THAT(both.error().what, HasSubstr(other));
    EXPECT_THAT(both.error().what, HasSubstr(why));
    EXPECT_THAT(both.error().what, HasSubstr("gdalwarp"));
  }
  EXPECT_TRUE(open({a, grid("5 6 / 7 8", 2.004, 0)}));
}

TEST_F(SmallGrids, NeighboursAcrossTheAntimeridian) {
  const auto east = geographic("1 2 / 3 4", 178, 0), west = geographic("5 6 / 7 8", -180, 0);
  const auto source = must_open({east, west});
  ASSERT_TRUE(source);
  expect_heights(*source, "1 2 5 6 / 3 4 7 8");
  EXPECT_EQ(height_at(*source, {179.5, 0})->height_m, 5.5);
}

TEST_F(SmallGrids, OutsideIsVoid) {
  const auto source = must_open({grid("1 2 / 3 4")});
  const auto window = source->read(-1, -1, 4, 4);
  ASSERT_TRUE(window);
  EXPECT_EQ(window->at(1, 1), 1);
  EXPECT_EQ(window->at(2, 2), 4);
  EXPECT_TRUE(window->is_void(0, 0) && window->is_void(3, 3) && window->is_void(3, 1));
  EXPECT_TRUE(source->read(1000000, -5, 3, 3)->is_void(1, 1));
}

TEST_F(SmallGrids, NodataInAllItsSpellings) {
  const std::string path = folder_.file("n.asc");
  const auto with = [&](const std::string& nodata, const std::string& value) {
    std::ofstream(path) << "ncols 2\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
                        << "NODATA_value " << nodata << "\n7.5 " << value << "\n"
                        << std::flush;
    const auto source = must_open({path});
    const auto grid = source->read(0, 0, 2, 1);
    EXPECT_TRUE(grid) << grid.error().what;
    EXPECT_EQ(grid->at(0, 0), 7.5f);
    return grid->is_void(1, 0);
  };
  EXPECT_TRUE(with("-9999", "-9999"));
  EXPECT_TRUE(with("nan", "nan"));
  EXPECT_TRUE(with("-3.402823466e+38", "-3.40282346638528859812e+38"));
  EXPECT_TRUE(with("-9999", "-3.4028234663852886e+38"));
  EXPECT_TRUE(with("999", "999.0"));
  EXPECT_FALSE(with("-9999", "-9998"));
}

TEST_F(SmallGrids, HeightsAtPlaces) {
  const auto source = must_open({geographic("0 10 20 / 40 50 . / 80 90 100")});
  ASSERT_TRUE(source);
  const auto at = [&](double lon, double lat) { return *height_at(*source, {lon, lat}); };
  EXPECT_EQ(at(0, 2).height_m, 0);                      // a post
  EXPECT_EQ(at(2, 0).height_m, 100);                    // the last post
  EXPECT_EQ(at(0.5, 1.5).height_m, 25);                 // bilinear
  EXPECT_EQ(at(2, 1).coverage, Coverage::void_);        // the void itself
  EXPECT_EQ(at(1.25, 1.75).coverage, Coverage::value);  // inside the triangle of the other three
  EXPECT_EQ(at(1.25, 1.75).height_m, 10 + 10 * 0.25 + 40 * 0.25);
  EXPECT_EQ(at(1.75, 1.25).coverage, Coverage::void_);  // beyond it
  EXPECT_EQ(at(1.5, 1).coverage, Coverage::void_);      // between a post and the void
  EXPECT_EQ(at(1, 1.5).height_m, 30);                   // on an edge that the void does not touch
  EXPECT_EQ(at(2.01, 1).coverage, Coverage::outside);
  EXPECT_EQ(at(1, -0.01).coverage, Coverage::outside);
  EXPECT_EQ(at(-100, 1).coverage, Coverage::outside);
}

TEST(HeightBetween, OneVoidIsLinearInTheOtherThree) {
  const auto plane = [](double x, double y) { return 3 + 2 * x - 5 * y; };
  for (int missing = 0; missing < 4; ++missing) {
    double z[4] = {plane(0, 0), plane(1, 0), plane(0, 1), plane(1, 1)};
    z[missing] = kNaN;
    int values = 0, voids = 0;
    for (int i = 0; i <= 16; ++i)
      for (int j = 0; j <= 16; ++j) {
        const double fx = i / 16.0, fy = j / 16.0;
        const double got = height_between(z[0], z[1], z[2], z[3], fx, fy);
        if (std::isnan(got)) {
          ++voids;
        } else {
          ++values;
          EXPECT_NEAR(got, plane(fx, fy), 1e-12);
        }
      }
    EXPECT_EQ(values, 17 * 18 / 2);  // a triangle with its rim
    EXPECT_EQ(voids, 16 * 17 / 2);
  }
  EXPECT_TRUE(std::isnan(height_between(kNaN, 1, 1, kNaN, 0.5, 0.5)));
  EXPECT_TRUE(std::isnan(height_between(kNaN, 1, kNaN, 1, 0.5, 0.5)));
  EXPECT_EQ(height_between(kNaN, 1, kNaN, 2, 1, 0.5), 1.5);
}

TEST(DemMosaic, SeamOfTwoSrtmTiles) {
  TIND_NEEDS_SHARED_DATA(east, "dem/N49W123.tif");
  const std::string west = test::shared_data("dem/N49W124.tif");
  const auto both = must_open({east, west}), a = must_open({east}), b = must_open({west});
  ASSERT_TRUE(both && a && b);
  EXPECT_EQ(both->info().cols, 2401);
  EXPECT_EQ(both->info().rows, 1201);
  const double step = 1.0 / 1200;
  for (const double lat : {49.2, 49.43121, 49.9}) {
    const auto before = height_at(*b, {-123 - step, lat}), seam = height_at(*a, {-123, lat}),
               after = height_at(*a, {-123 + step, lat});
    const auto h = [&](double lon) { return height_at(*both, {lon, lat})->height_m; };
    EXPECT_NEAR(h(-123), seam->height_m, 1e-5);
    EXPECT_NEAR(h(-123 - step / 2), (before->height_m + seam->height_m) / 2, 1e-5);
    EXPECT_NEAR(h(-123 + step / 2), (after->height_m + seam->height_m) / 2, 1e-5);
  }
}

TEST(DemMosaic, FilesThatOnlyTouchLeaveNoGap) {
  TIND_NEEDS_SHARED_DATA(south, "dem/N41E001.hgt.zip");
  const auto both = must_open({south, test::shared_data("dem/N42E001.hgt.zip")});
  ASSERT_TRUE(both);
  EXPECT_EQ(both->info().rows, 2401);
  EXPECT_EQ(both->info().bounds.south, 41);
  EXPECT_EQ(both->info().bounds.north, 43);
}

TEST(DemCache, TheSamePostsInAnyWindowFromAnyThread) {
  const std::string path = test::testdata("rainier.tif");
  const auto source =
      must_open({path}, {.to_datum = TargetDatum::ellipsoid, .cache_bytes = 300000});
  const auto whole = source->read(0, 0, 577, 481);
  ASSERT_TRUE(whole);
  std::atomic<int> different = 0, errors = 0;
  {
    std::vector<std::jthread> threads;
    for (unsigned seed = 0; seed < 8; ++seed)
      threads.emplace_back([&, seed] {
        std::mt19937 random(seed);
        for (int k = 0; k < 30; ++k) {
          const int step = 1 << random() % 8, cols = 1 + random() % 90, rows = 1 + random() % 90;
          const int col = int(random() % 600) - 10, row = int(random() % 500) - 10;
          const auto part = source->read_decimated(col, row, cols, rows, step);
          if (!part)
            ++errors;
          else
            for (int r = 0; r < rows; ++r)
              for (int c = 0; c < cols; ++c) {
                const int x = col + c * step, y = row + r * step;
                const float want = whole->inside(x, y) ? whole->at(x, y) : HeightGrid::kVoid;
                const float got = part->at(c, r);
                if (std::memcmp(&want, &got, 4) != 0 && !(std::isnan(want) && std::isnan(got)))
                  ++different;
              }
        }
      });
  }
  EXPECT_EQ(errors, 0);
  EXPECT_EQ(different, 0);
}

/// In a projected raster the geoid is looked up over cells of posts: the same, to a hundredth of
/// the rounding, as at each post's exact place.
TEST(DatumShift, ProjectedPostsGetTheUndulationOfTheirPlace) {
  const std::string path = test::testdata("bigtujunga_crop.tif");
  const auto plain = must_open({path}, {.from_datum = VerticalDatum::egm96});
  const auto shifted =
      must_open({path}, {.from_datum = VerticalDatum::egm96, .to_datum = TargetDatum::ellipsoid});
  ASSERT_TRUE(plain && shifted);
  EXPECT_EQ(plain->info().rounding_m, 0);
  EXPECT_EQ(shifted->info().datum, VerticalDatum::ellipsoid);
  const auto geoid = test::environment()->egm96();
  ASSERT_TRUE(geoid);
  const auto z = plain->read(0, 0, 200, 200), h = shifted->read(0, 0, 200, 200);
  ASSERT_TRUE(z && h);
  for (int r = 0; r < 200; r += 3)
    for (int c = 0; c < 200; c += 3) {
      const Vec2 post{double(c), double(r)};
      Geographic place;
      plain->to_geographic({&post, 1}, {&place, 1});
      EXPECT_NEAR(h->at(c, r), z->at(c, r) + (*geoid)->undulation(place),
                  shifted->info().rounding_m + 5e-6);
      EXPECT_EQ(shifted->read_decimated(c, r, 1, 1, 100)->at(0, 0), h->at(c, r));
    }
}

TEST(DatumShift, UnknownHeightsStayAndSaySo) {
  const std::string path = test::testdata("bigtujunga_crop.tif");
  const auto same = must_open({path}),
             lenient = must_open({path}, {.to_datum = TargetDatum::ellipsoid_if_known});
  EXPECT_EQ(lenient->info().datum, VerticalDatum::unknown);
  EXPECT_EQ(same->read(7, 7, 1, 1)->at(0, 0), lenient->read(7, 7, 1, 1)->at(0, 0));
  ASSERT_EQ(lenient->info().warnings.size(), 1u);
  EXPECT_THAT(lenient->info().warnings[0], HasSubstr("--from-datum"));
  EXPECT_TRUE(same->info().warnings.empty());
  const auto asked = DemSource::open({&path, 1}, {.to_datum = TargetDatum::ellipsoid});
  ASSERT_FALSE(asked);
  EXPECT_THAT(asked.error().what, HasSubstr("--from-datum"));
}

/// A raster in a compound CRS.
std::string raster_in(const std::string& srs, const test::TempDir& folder) {
  test::write_bytes(folder.file("N46E007.hgt"), test::srtm(111));
  const std::string path = folder.file("in.vrt");
  std::ofstream(path) << R"(<VRTDataset rasterXSize="1201" rasterYSize="1201"><SRS>)" << srs
                      << R"(</SRS><GeoTransform>7, 0.001, 0, 47, 0, -0.001</GeoTransform>
    <VRTRasterBand dataType="Int16" band="1"><SimpleSource>
      <SourceFilename relativeToVRT="1">N46E007.hgt</SourceFilename><SourceBand>1</SourceBand>
    </SimpleSource></VRTRasterBand></VRTDataset>)";
  return path;
}

TEST(DatumShift, ADatumWhoseGridIsMissingIsNamed) {
  const std::pair<const char*, const char*> kOthers[] = {
      {"EPSG:4326+3855", "EGM2008"}, {"EPSG:4269+5703", "NAVD88"}, {"EPSG:4258+7837", "DHHN2016"}};
  for (const auto& [srs, datum] : kOthers) {
    const test::TempDir folder;
    const std::string path = raster_in(srs, folder);
    const auto plain = must_open({path}, {.allow_vrt = true});
    EXPECT_NE(plain->info().datum, VerticalDatum::unknown);
    EXPECT_EQ(plain->info().datum, plain->info().source_datum);
    EXPECT_THAT(plain->info().vertical_crs, HasSubstr(datum));
    const auto asked = DemSource::open({&path, 1}, {.to_datum = TargetDatum::ellipsoid,
                                                    .allow_vrt = true,
                                                    .environment = test::environment()});
    ASSERT_FALSE(asked);
    EXPECT_THAT(asked.error().what, AllOf(HasSubstr(datum), HasSubstr(path)));
    // Somebody says otherwise: it is done, and said.
    const auto said = must_open({path}, {.from_datum = VerticalDatum::egm96, .allow_vrt = true});
    EXPECT_THAT(said->info().warnings,
                testing::Contains(AllOf(HasSubstr(datum), HasSubstr("above egm96"))));
  }
  const test::TempDir folder;
  const std::string agrees = raster_in("EPSG:4326+5773", folder);
  EXPECT_TRUE(must_open({agrees}, {.from_datum = VerticalDatum::egm96, .allow_vrt = true})
                  ->info()
                  .warnings.empty());
}

/// What is read of an ASCII grid of 3 x 2 posts.
std::shared_ptr<const DemSource> grid_of(const test::TempDir& folder, const std::string& posts,
                                         const DemOptions& options, const std::string& head = "") {
  const std::string path = folder.file("g.asc");
  std::ofstream(path) << "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
                      << head << posts << "\n";
  auto source = must_open({path}, options);
  return source;
}

TEST(Nodata, WhatLooksLikeItIsCountedOnceAndNotWhenItIsDeclared) {
  const test::TempDir folder;
  const std::string posts = "1 -9999 3\n-9999 -32768 6";
  const auto source = grid_of(folder, posts, {.cache_bytes = 1});
  EXPECT_TRUE(source->undeclared_nodata().empty());  // nothing read yet
  for (int i = 0; i < 3; ++i) EXPECT_EQ(source->read(0, 0, 3, 2)->at(1, 0), -9999);
  EXPECT_EQ(source->read_decimated(1, 0, 1, 1, 100)->at(0, 0), -9999);
  const auto found = source->undeclared_nodata();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].value, -9999);
  EXPECT_EQ(found[0].posts, 2u);
  EXPECT_EQ(found[1].value, -32768);
  EXPECT_THAT(undeclared_nodata_text(*source),
              AllOf(HasSubstr("2 posts are -9999"), HasSubstr("--nodata -9999,-32768")));

  // What was said already is part of what to say.
  DemOptions options;
  ASSERT_TRUE(set_nodata("none,-32768", options));
  const auto half = grid_of(folder, posts, options);
  ASSERT_TRUE(half->read(0, 0, 3, 2));
  EXPECT_TRUE(undeclared_nodata_text(*half).ends_with("--nodata none,-32768,-9999"))
      << undeclared_nodata_text(*half);

  const auto declared = grid_of(folder, posts, {}, "NODATA_value -9999\n");
  EXPECT_TRUE(std::isnan(declared->read(0, 0, 3, 2)->at(1, 0)));
  ASSERT_EQ(declared->undeclared_nodata().size(), 1u);
  EXPECT_EQ(declared->undeclared_nodata()[0].value, -32768);
}

TEST(Nodata, OfSeveralFilesThoseAreNamedThatHaveIt) {
  const test::TempDir folder;
  std::vector<std::string> files;
  for (const auto& [name, west, posts] :
       {std::tuple{"a.asc", 0, "1 2 3\n4 5 6\n"}, std::tuple{"b.asc", 3, "1 -9999 3\n4 5 6\n"},
        std::tuple{"c.asc", 6, "1 2 3\n-9999 5 6\n"}}) {
    files.push_back(folder.file(name));
    std::ofstream(files.back()) << "ncols 3\nnrows 2\nxllcorner " << west
                                << "\nyllcorner 0\ncellsize 1\n"
                                << posts;
  }
  const auto all = must_open(files);
  ASSERT_TRUE(all->read(0, 0, 9, 2));
  ASSERT_EQ(all->undeclared_nodata().size(), 1u);
  EXPECT_EQ(all->undeclared_nodata()[0].files, (std::vector<std::size_t>{1, 2}));
  EXPECT_THAT(undeclared_nodata_text(*all),
              StartsWith(files[1] + " and 1 more: 2 posts are -9999"));
}

TEST(Nodata, IsWhatTheUserSays) {
  const test::TempDir folder;
  DemOptions options;
  ASSERT_TRUE(set_nodata("none,5,-7.5", options));
  EXPECT_TRUE(options.ignore_declared_nodata);
  EXPECT_EQ(options.nodata, (std::vector<double>{5, -7.5}));
  for (const char* wrong : {"", "x", "5,", ",5", "nan", "1e999", "5 6", "none5"})
    EXPECT_FALSE(set_nodata(wrong, options)) << wrong;

  const auto read = [&](const std::string& nodata) {
    DemOptions said;
    EXPECT_TRUE(nodata.empty() || set_nodata(nodata, said));
    const auto source = grid_of(folder, "1 2 3\n4 5 6", said, "NODATA_value 2\n");
    const auto grid = source->read(0, 0, 3, 2);
    std::string voids;
    for (const float z : grid->values()) voids += std::isnan(z) ? '.' : 'x';
    return voids + " " + source->info().fingerprint;
  };
  EXPECT_THAT(read(""), testing::StartsWith("x.xxxx"));
  EXPECT_THAT(read("5"), testing::StartsWith("x.xx.x"));
  EXPECT_THAT(read("none"), testing::StartsWith("xxxxxx"));
  EXPECT_THAT(read("none,6,1"), testing::StartsWith(".xxxx."));
  EXPECT_NE(read("5").substr(7), read("4").substr(7));
}

TEST(Nodata, BeyondWhatCanBeConvertedTheMessageSaysIt) {
  const test::TempDir folder;
  test::write_bytes(folder.file("N46E007.hgt"),
                    test::srtm([](int c, int) { return c == 9 ? 32767 : 5; }));
  const auto source = must_open({folder.file("N46E007.hgt")}, {.to_datum = TargetDatum::ellipsoid});
  const auto got = source->read(0, 0, 20, 20);
  ASSERT_FALSE(got);
  EXPECT_THAT(got.error().what, AllOf(HasSubstr("posts are 32767"), HasSubstr("--nodata 32767")));
}

TEST(DemInfo, FingerprintFollowsContentAndOptions) {
  const test::TempDir folder;
  const std::string path = folder.file("a.tif");
  std::filesystem::copy_file(test::testdata("rainier.tif"), path);
  const auto print = [&](const DemOptions& options) {
    return must_open({path}, options)->info().fingerprint;
  };
  const std::string first = print({});
  EXPECT_EQ(first, print({}));
  EXPECT_EQ(first, print({.cache_bytes = 1}));
  EXPECT_NE(first, print({.to_datum = TargetDatum::ellipsoid}));
  EXPECT_NE(first, print({.from_datum = VerticalDatum::ellipsoid}));
  std::filesystem::last_write_time(
      path, std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  EXPECT_NE(first, print({}));
}

TEST(DemUnits, FeetOrAsTheyAre) {
  TIND_NEEDS_SHARED_DATA(path, "dem/autzen_minz_3ft_epsg2994.tif");
  const auto metres = must_open({path}), feet = must_open({path}, {.keep_source_units = true});
  const auto m = metres->read(0, 0, 394, 188), ft = feet->read(0, 0, 394, 188);
  ASSERT_TRUE(m && ft);
  EXPECT_EQ(feet->info().rounding_m, 0);
  EXPECT_NEAR(metres->info().crs_unit_m, 0.3048, 1e-12);
  EXPECT_NEAR(metres->info().spacing_x_m, 3 * 0.3048, 1e-3);
  for (std::size_t i = 0; i < m->size(); ++i) {
    const float a = m->values()[i], b = ft->values()[i];
    EXPECT_EQ(std::isnan(a), std::isnan(b));
    if (!std::isnan(a)) {
      EXPECT_EQ(a, float(double(b) * 0.3048));
    }
  }
}

}  // namespace
}  // namespace tind
