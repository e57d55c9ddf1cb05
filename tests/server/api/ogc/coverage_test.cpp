// A coverage's pixels are H: as /elevation has it where they are as fine as the posts, its mean
// where they are coarser.

#include <sstream>

#include "server/api/ogc/coverage_query.h"
#include "terrain/raster/dem_source.h"
#include "tests/server/api/ogc/ogc_fixture.h"

namespace tind::api {
namespace {

const std::string kCoverage = "/collections/rainier/coverage";

class Coverages : public Ogc {
 protected:
  /// As GDAL reads it.
  std::shared_ptr<const DemSource> opened(const std::string& query,
                                          const std::string& name = "a.tif") {
    const HttpReply reply = get(kCoverage + query);
    EXPECT_EQ(reply.status, 200) << reply.body;
    const std::string path = dir_.file(name);
    std::ofstream(path, std::ios::binary) << reply.body;
    auto dem = DemSource::open(std::vector{path});
    EXPECT_TRUE(dem) << (dem ? "" : dem.error().what);
    return dem ? *dem : nullptr;
  }
};

TEST_F(Coverages, FinePixelsAreHeights) {
  const std::string window = "?bbox=-121.746,46.857,-121.738,46.865&width=24&height=20";
  const Json got = json(kCoverage + window + "&f=covjson");
  const Json &x = got["domain"]["axes"]["x"], &values = got["ranges"]["height"]["values"];
  ASSERT_EQ(values.size(), 480u);
  const double pixel = 0.008 / 24;
  EXPECT_NEAR(x["start"].get<double>(), -121.746 + pixel / 2, 1e-12);
  const auto dem = opened(window);
  ASSERT_TRUE(dem);
  EXPECT_EQ(dem->info().cols, 24);
  EXPECT_EQ(name(dem->info().datum), "egm96") << "the file says what its heights are above";
  const auto read = dem->read(0, 0, 24, 20);
  int compared = 0;
  for (int row = 0; row < 20; ++row)
    for (int col = 0; col < 24; col += 5) {
      const Json said = height(-121.746 + (col + .5) * pixel, 46.865 - (row + .5) * .008 / 20);
      const Json& ours = values[std::size_t(row * 24 + col)];
      ASSERT_EQ(ours.is_null(), said.is_null());
      ASSERT_EQ(read->is_void(col, row), said.is_null());
      if (said.is_null()) continue;
      EXPECT_NEAR(read->at(col, row), said.get<double>(), 1e-3);
      EXPECT_NEAR(ours.get<double>(), said.get<double>(), 2e-3);
      ++compared;
    }
  EXPECT_GT(compared, 80);
}

TEST_F(Coverages, TheWholeIsTheDemItself) {
  const auto whole = opened(""), dem = *DemSource::open(std::vector{test::testdata("rainier.tif")});
  ASSERT_TRUE(whole);
  ASSERT_EQ(whole->info().cols, dem->info().cols);
  ASSERT_EQ(whole->info().rows, dem->info().rows);
  const auto ours = whole->read(0, 0, 577, 481), posts = dem->read(0, 0, 577, 481);
  for (std::size_t i = 0; i < posts->size(); ++i)
    if (!std::isnan(posts->values()[i])) {
      ASSERT_NEAR(ours->values()[i], posts->values()[i], 1e-3) << i;
    }
}

TEST_F(Coverages, ASubsetOfOneAxisLeavesTheOtherWhole) {
  const auto whole = opened(""), part = opened("?subset=Lon(-121.9:-121.6)", "part.tif");
  ASSERT_TRUE(whole && part);
  EXPECT_EQ(part->info().rows, whole->info().rows);
  EXPECT_NEAR(part->info().post_to_crs.y0, whole->info().post_to_crs.y0, 1e-9);
  EXPECT_EQ(get(kCoverage + "?subset=Lon(-121.9:-121.6),Lon(-121.8:-121.7)").status, 400);
  EXPECT_EQ(get(kCoverage + "?scale-size=Lon(5),Lon(10)").status, 400);
}

TEST_F(Coverages, TheWholeInTheDemsOwnSystemIsItsGrid) {
  const std::string file = test::testdata("bigtujunga_crop.tif");
  ASSERT_TRUE(services::open_dataset(catalog_, {"tujunga", {file}}, {}, {}));
  const HttpReply reply = get("/collections/tujunga/coverage?crs=EPSG:32611");
  ASSERT_EQ(reply.status, 200) << reply.body;
  std::ofstream(dir_.file("own.tif"), std::ios::binary) << reply.body;
  const auto ours = DemSource::open(std::vector{dir_.file("own.tif")}),
             dem = DemSource::open(std::vector{file});
  ASSERT_TRUE(ours && dem);
  const DemInfo &a = (*ours)->info(), &b = (*dem)->info();
  ASSERT_EQ(std::pair(a.cols, a.rows), std::pair(b.cols, b.rows));
  EXPECT_NEAR(a.post_to_crs.x0, b.post_to_crs.x0, 1e-6);
  EXPECT_NEAR(a.post_to_crs.y0, b.post_to_crs.y0, 1e-6);
  EXPECT_NEAR(a.post_to_crs.x_col, b.post_to_crs.x_col, 1e-9);
  const auto p = (*ours)->read(0, 0, int(a.cols), int(a.rows)),
             q = (*dem)->read(0, 0, int(a.cols), int(a.rows));
  for (std::size_t i = 0; i < p->size(); ++i) {
    ASSERT_EQ(std::isnan(p->values()[i]), std::isnan(q->values()[i])) << i;
    if (!std::isnan(q->values()[i])) {
      ASSERT_NEAR(p->values()[i], q->values()[i], 2e-3) << i;
    }
  }
}

TEST_F(Coverages, OfDegreesHasItsPostsAllOverTheGlobe) {
  int number = 0;
  for (const double first : {-177.5, -180.0, 2.5, -178.5}) {  // longitudes of the first posts
    const std::string name = "globe" + std::to_string(number++), path = dir_.file(name + ".asc");
    std::ofstream file(path);
    file << "ncols 72\nnrows 36\nxllcenter " << first << "\nyllcenter -87.5\ncellsize 5\n";
    for (int i = 0; i < 72 * 36; ++i) file << i << (i % 72 < 71 ? ' ' : '\n');
    file.close();
    DemOptions options;
    options.crs = "EPSG:4326";
    ASSERT_TRUE(services::open_dataset(catalog_, {name, {path}}, options, {}));
    const Json whole = json("/collections/" + name + "/coverage?f=covjson");
    const Json& x = whole["domain"]["axes"]["x"];
    ASSERT_EQ(x["num"], 72) << whole["domain"];
    ASSERT_EQ(whole["domain"]["axes"]["y"]["num"], 36);
    const double columns = (x["start"].get<double>() - first) / 5;
    EXPECT_NEAR(columns, std::round(columns), 1e-9) << "a pixel's middle is a post: " << x;
    const int skipped = (int(std::round(columns)) + 72) % 72;
    const Json& values = whole["ranges"]["height"]["values"];
    for (int i = 0; i < 72 * 36; i += 7)
      ASSERT_NEAR(values[std::size_t(i)].get<double>(), i / 72 * 72 + (i + skipped) % 72, 2e-3)
          << first << ' ' << i;
    const Json part = json("/collections/" + name + "/coverage?f=covjson&bbox=0,60,20,80");
    EXPECT_EQ(part["domain"]["axes"]["x"]["num"], 4) << "not fewer beside a pole";
    EXPECT_EQ(part["domain"]["axes"]["y"]["num"], 4);
  }
}

/// Web maps end before it; a coverage is none.
TEST_F(Coverages, OfAPoleIsInItsOwnSystemAndInDegrees) {
  std::ofstream file(dir_.file("polar.asc"));
  file << "ncols 21\nnrows 21\nxllcenter -200000\nyllcenter -200000\ncellsize 20000\n";
  for (int i = 0; i < 21 * 21; ++i) file << 100 + i % 50 << (i % 21 < 20 ? ' ' : '\n');
  file.close();
  DemOptions options;
  options.crs = "EPSG:3413";
  ASSERT_TRUE(services::open_dataset(catalog_, {"polar", {dir_.file("polar.asc")}}, options, {}));
  const std::string coverage = "/collections/polar/coverage";
  const HttpReply own = get(coverage + "?crs=EPSG:3413");
  ASSERT_EQ(own.status, 200) << own.body;
  std::ofstream(dir_.file("own.tif"), std::ios::binary) << own.body;
  const auto dem = DemSource::open(std::vector{dir_.file("own.tif")});
  ASSERT_TRUE(dem) << dem.error().what;
  ASSERT_EQ((*dem)->info().cols, 21);
  ASSERT_EQ((*dem)->info().rows, 21);
  const auto posts = (*dem)->read(0, 0, 21, 21);
  for (int i = 0; i < 21 * 21; ++i) ASSERT_NEAR(posts->at(i % 21, i / 21), 100 + i % 50, 2e-3) << i;
  const Json degrees = json(coverage + "?bbox=-180,88.5,180,90&width=24&height=4&f=covjson");
  EXPECT_EQ(degrees["ranges"]["height"]["values"].size(), 96u);
  for (const Json& height : degrees["ranges"]["height"]["values"]) EXPECT_FALSE(height.is_null());
  EXPECT_EQ(get(coverage + "?crs=EPSG:3857").status, 400) << "it has no place there";
  EXPECT_EQ(get("/shade/polar/tiles.json").status, 404) << "a web map has none, either";
}

TEST(CoverageWindow, OfTheWholeGlobeHasEveryColumnOnce) {
  DatasetFacts facts;
  facts.box = {-180, -60, 180, 60};
  const auto crs = ogc::AskedCrs::make("CRS84", facts);
  ASSERT_TRUE(crs);
  const double degree = 111'319.5;  // at the equator
  const ogc::PostGrid grid(Vec2{degree, degree});
  const auto window = ogc::coverage_window({}, *crs, *crs, facts, grid, grid);
  ASSERT_TRUE(window);
  EXPECT_EQ(window->box.width(), 360);
  EXPECT_NEAR(window->box.west, -180.5, 0.01) << "the first column is in the middle of its pixels";
}

TEST_F(Coverages, EveryFormatSaysTheSame) {
  const std::string window = "?bbox=590000,5185000,600000,5195000&bbox-crs=EPSG:32610&width=50";
  const auto tif = opened(window), asc = opened(window + "&f=asc", "a.asc");
  ASSERT_TRUE(tif && asc);
  EXPECT_EQ(tif->info().crs_kind, CrsKind::projected);
  EXPECT_NEAR(tif->info().post_to_crs.x_col, 200, 1e-9);
  EXPECT_NEAR(double(tif->info().rows), 50, 1) << "pixels are as long as they are wide";
  const int rows = int(tif->info().rows);
  const auto a = tif->read(0, 0, 50, rows), b = asc->read(0, 0, 50, rows);
  for (std::size_t i = 0; i < a->size(); ++i)
    EXPECT_TRUE(a->values()[i] == b->values()[i] ||
                (std::isnan(a->values()[i]) && std::isnan(b->values()[i])));
  const HttpReply png = get(kCoverage + window + "&f=png");
  EXPECT_EQ(png.headers.at("content-type"), "image/png");
  EXPECT_NE(png.body.find("height_m"), std::string::npos);
}

TEST_F(Coverages, AreAsClientsAskForThem) {
  const std::string plain =
      get(kCoverage + "?bbox=-121.9,46.8,-121.7,46.9&width=64&height=32").body;
  for (const char* query :
       {"?subset=Lon(-121.9:-121.7),Lat(46.8:46.9)&scale-size=Lon(64),Lat(32)",
        "?subset=Lat(46.8:46.9),Long(-121.9:-121.7)&scaleSize=Lat(32),Lon(64)",
        "?bbox=46.8,-121.9,46.9,-121.7&bbox-crs=EPSG:4326&crs=CRS84&width=64&height=32"})
    EXPECT_EQ(get(kCoverage + query).body, plain) << query;
  EXPECT_EQ(get(kCoverage, "Accept: image/tiff;application=geotiff\r\n").headers.at("content-type"),
            "image/tiff; application=geotiff");
  EXPECT_EQ(get(kCoverage + "?width=9", "Accept: image/png\r\n").headers.at("content-type"),
            "image/png");
  const auto beyond = opened("?bbox=-122.5,46,-122,47&width=40");
  ASSERT_TRUE(beyond);
  EXPECT_TRUE(beyond->read(0, 0, 1, 1)->is_void(0, 0)) << "beyond the DEM there is nothing";
}

TEST_F(Coverages, HaveTheDatumThatIsAskedFor) {
  const std::string window = "?bbox=-121.746,46.857,-121.738,46.865&width=5&height=5";
  const auto own = opened(window), globe = opened(window + "&datum=ellipsoid", "b.tif");
  ASSERT_TRUE(own && globe);
  EXPECT_EQ(name(globe->info().datum), "ellipsoid");
  const double lower = own->read(2, 2, 1, 1)->at(0, 0) - globe->read(2, 2, 1, 1)->at(0, 0);
  EXPECT_GT(lower, 15);
  EXPECT_LT(lower, 25);
}

TEST_F(Coverages, WhatIsWrongNamesItsParameter) {
  struct Case {
    std::string query, parameter;
  };
  for (const Case& c :
       {Case{"bbox=1,2,3", "bbox"}, Case{"bbox=3,2,1,0", "bbox"}, Case{"bbox=1,2,1,4", "bbox"},
        Case{"width=0", "width"}, Case{"width=5000&height=5000", "width"},
        Case{"width=60000", "width"}, Case{"width=2000&height=2000&f=asc", "width"},
        Case{"height=1.5", "height"}, Case{"f=jp2", "f"}, Case{"crs=EPSG:5773", "crs"},
        Case{"bbox-crs=WGS84", "bbox-crs"}, Case{"subset=Lon(1:2", "subset"},
        Case{"subset=Time(1:2)", "subset"}, Case{"subset=Lon(2:1)", "subset"},
        Case{"subset=Lon(1:2)&bbox=1,2,3,4", "subset"}, Case{"scale-size=Lon(0)", "scale-size"},
        Case{"scale-size=Lon(9)&width=9", "scale-size"}, Case{"datum=none", "datum"},
        Case{"interpolation=cubic", "interpolation"}})
    expect_wrong(kCoverage + "?" + c.query, c.parameter);
  EXPECT_EQ(get("/collections/made-up/coverage").status, 404);
  EXPECT_EQ(get("/collections/none/coverage").status, 404);
}

}  // namespace
}  // namespace tind::api
