// The program itself: --breaklines, --flatten and --boundary, through every method.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>

#include "terrain/base/file_io.h"
#include "terrain/mesh/constrained_delaunay.h"
#include "terrain/raster/vector_file.h"
#include "terrain/simplify/methods.h"
#include "tests/support/program_json.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::Ran;
using test::run_tind;
using test::TempDir;
using test::testdata;

std::string lines() { return " --breaklines " + testdata("breaklines.geojson"); }
std::string lake() { return " --flatten " + testdata("lake.geojson"); }
std::string boundary() { return " --boundary " + testdata("boundary.geojson"); }

class LineOptions : public testing::Test {
 protected:
  const TempDir dir_;
  const std::string simplify_ =
      "simplify " + testdata("bigtujunga_crop.tif") + " -o " + dir_.file("a.ply") + " --ratio 0.08";
};

TEST_F(LineOptions, HoldThroughEveryMethod) {
  if (!has_constrained_delaunay()) GTEST_SKIP() << "built without CGAL";
  for (const MethodInfo& method : methods()) {
    SCOPED_TRACE(method.name);
    const auto made = test::tind_json(simplify_ + lines() + lake() + boundary() +
                                      " --json --progress none --method " + method.name);
    EXPECT_EQ(made["flipped"], 0);
    EXPECT_EQ(made["posts_uncovered"], 0);
    const auto& l = made["lines"];
    EXPECT_GT(l["parts"], 40);
    EXPECT_EQ(l["parts_missing"], 0);
    EXPECT_EQ(l["triangles_not_level"], 0);
    EXPECT_EQ(l["breaklines"], 6);
    EXPECT_EQ(l["without_length"], 1);
    EXPECT_GE(l["outside"], 1);
    EXPECT_GE(l["crossings"], 2);
    EXPECT_GE(l["overlaps"], 6);
    EXPECT_GT(l["posts_flattened"], 500);
    EXPECT_GT(l["posts_outside"], 8000);
    EXPECT_GT(made["peak_mb"], 1);
  }
}

/// What ends on the DEM's side is held as all of it: a neighbour on the side may not take its
/// place.
TEST_F(LineOptions, HoldTheirEndsOnTheRim) {
  if (!has_constrained_delaunay()) GTEST_SKIP() << "built without CGAL";
  const std::string how =
      " --crs EPSG:32633 --from-datum egm96 --effort best --json --progress none -o " +
      dir_.file("a.ply");
  const auto lines =
      test::tind_json("simplify " + testdata("line_ends.asc") + how + " --breaklines " +
                      testdata("line_ends.geojson") + " --line-heights dem --max-error 4");
  EXPECT_EQ(lines["lines"]["parts"], 16);
  EXPECT_EQ(lines["lines"]["parts_missing"], 0);
  const auto rims =
      test::tind_json("simplify " + testdata("rim_ends.asc") + how + " --voids keep --max-error 2");
  EXPECT_EQ(rims["posts_uncovered"], 0);
  EXPECT_LE(rims["max_error_m"], 2);
}

/// Both halves of a bow tie have a vertex where they touch.
TEST_F(LineOptions, OfABoundaryThatTouchesItselfAreAllThere) {
  if (!has_constrained_delaunay()) GTEST_SKIP() << "built without CGAL";
  std::ofstream grid(dir_.file("g.asc"));
  grid << "ncols 30\nnrows 30\nxllcenter 0\nyllcenter 0\ncellsize 1\n";
  for (int i = 0; i < 900; ++i) grid << (i * 7919) % 97 << ((i + 1) % 30 ? " " : "\n");
  grid.close();
  std::ofstream(dir_.file("bow.geojson"))
      << R"({"type": "Polygon", "coordinates": [[[4.3,5.2],[24.3,25.2],[24.3,5.2],[4.3,25.2],[4.3,5.2]]]})";
  for (const MethodInfo& method : methods()) {
    const auto made =
        test::tind_json("simplify " + dir_.file("g.asc") + " --crs EPSG:4326 --ratio 0.5 -o " +
                        dir_.file("g.ply") + " --json --progress none --boundary " +
                        dir_.file("bow.geojson") + " --method " + method.name);
    EXPECT_EQ(made["lines"]["parts"], 6) << method.name;
    EXPECT_EQ(made["lines"]["parts_missing"], 0) << method.name;
  }
}

TEST_F(LineOptions, AreRefusedInOneLine) {
  const auto refuses = [&](const std::string& more, int code, const std::string& word) {
    const Ran ran = run_tind(simplify_ + more);
    EXPECT_EQ(ran.code, code) << ran.out;
    EXPECT_NE(ran.out.find(word), std::string::npos) << ran.out;
    EXPECT_EQ(std::count(ran.out.begin(), ran.out.end(), '\n'), 1) << ran.out;
  };
  if (!has_constrained_delaunay()) {
    refuses(lines(), 65, "TIND_WITH_CGAL");
    return;
  }
  refuses(" --breaklines " + dir_.file("none.geojson"), 69, "none.geojson");
  std::ofstream(dir_.file("text.geojson")) << "no vectors";
  refuses(" --breaklines " + dir_.file("text.geojson"), 65, "text.geojson");
  refuses(" --flatten " + testdata("breaklines.geojson"), 65, "polygons are needed");
  for (const char* height : {"1e999", "-1e30"}) {
    std::ofstream(dir_.file("high.geojson"))
        << R"({"type": "LineString", "coordinates": [[-118.14, 34.33, )" << height
        << "], [-118.13, 34.331, 900]]}";
    refuses(" --breaklines " + dir_.file("high.geojson"), 65, "which no ground has");
  }
  refuses(lines() + " --method bounded --side above", 2, "--side is both");
}

TEST_F(LineOptions, CornersOnPostsAreFlattenedToo) {
  if (!has_constrained_delaunay()) GTEST_SKIP() << "built without CGAL";
  std::ofstream grid(dir_.file("g.asc"));
  grid << "ncols 9\nnrows 9\nxllcenter 0\nyllcenter 0\ncellsize 1\n";
  for (int i = 0; i < 81; ++i) grid << 10 * (i % 9) + i / 9 << ((i + 1) % 9 ? " " : "\n");
  grid.close();
  std::ofstream(dir_.file("pond.geojson"))
      << R"({"type": "Polygon", "coordinates": [[[2,2],[6,2],[6,6],[2,6],[2,2]]]})";
  const auto made = test::tind_json(
      "simplify " + dir_.file("g.asc") + " --crs EPSG:4326 --max-error 1 -o " + dir_.file("g.ply") +
      " --json --progress none --flatten " + dir_.file("pond.geojson"));
  EXPECT_EQ(made["lines"]["posts_flattened"], 25) << made;
  EXPECT_LE(double(made["max_error_m"]), 1);
}

TEST_F(LineOptions, ZerosForHeightsAreToldAndCanBeIgnored) {
  if (!has_constrained_delaunay()) GTEST_SKIP() << "built without CGAL";
  nlohmann::json flat = nlohmann::json::parse(std::ifstream(testdata("breaklines.geojson")));
  for (auto& feature : flat["features"])
    for (auto& place : feature["geometry"]["coordinates"]) {
      while (place.size() > 2) place.erase(2);
      place.push_back(0);
    }
  std::ofstream(dir_.file("zero.geojson")) << flat.dump();
  const std::string command =
      simplify_ + " --json --progress none --method qem --breaklines " + dir_.file("zero.geojson");
  const Ran own = run_tind(command), dem = run_tind(command + " --line-heights dem");
  ASSERT_EQ(own.code, 0) << own.out;
  ASSERT_EQ(dem.code, 0) << dem.out;
  EXPECT_NE(own.out.find("--line-heights dem"), std::string::npos);
  EXPECT_NE(own.out.find("zero.geojson"), std::string::npos);
  EXPECT_EQ(dem.out.find("warning"), std::string::npos);
  flat["features"][0]["geometry"]["coordinates"][0][2] = 1000;
  std::ofstream(dir_.file("zero.geojson")) << flat.dump();
  const Ran some = run_tind(command);
  EXPECT_NE(some.out.find("are exactly 0"), std::string::npos) << some.out;
  EXPECT_NE(some.out.find("Shapefile"), std::string::npos) << some.out;
  EXPECT_GT(nlohmann::json::parse(own.answer)["max_error_m"], 300);
  EXPECT_LT(nlohmann::json::parse(dem.answer)["max_error_m"], 300);
}

/// 30 x 30 posts of 10 m in UTM zone 33, and lines of one height over them.
class LineDatums : public LineOptions {
 protected:
  void SetUp() override {
    if (!has_constrained_delaunay()) GTEST_SKIP() << "built without CGAL";
    std::ofstream grid(dir_.file("g.asc"));
    grid << "ncols 30\nnrows 30\nxllcenter 500000\nyllcenter 5000000\ncellsize 10\n";
    for (int i = 0; i < 900; ++i) grid << 100 + i % 30 << ((i + 1) % 30 ? " " : "\n");
  }

  std::string line_in(const std::string& crs) {
    std::ofstream(dir_.file("line.geojson"))
        << R"({"type":"FeatureCollection","crs":{"type":"name","properties":{"name":")" << crs
        << R"("}},"features":[{"type":"Feature","properties":{},"geometry":{"type":"LineString",)"
        << R"("coordinates":[[500055,5000052,300],[500200,5000210,300]]}}]})";
    return " --breaklines " + dir_.file("line.geojson");
  }
  /// A triangle at 300 m in a GeoPackage.
  std::string lake_in(const std::string& crs) {
    const std::array<std::array<double, 3>, 3> corners{
        {{15.0008, 45.1541, 300}, {15.0024, 45.1541, 300}, {15.0016, 45.1552, 300}}};
    const std::array<std::array<std::uint32_t, 3>, 1> all{{{0, 1, 2}}};
    const auto bytes = encode_triangles(VectorFormat::geopackage, {corners, all, crs, ""});
    EXPECT_TRUE(bytes) << bytes.error().what;
    EXPECT_TRUE(write_whole_file(dir_.file("lake.gpkg"), bytes.value_or("")));
    return " --flatten " + dir_.file("lake.gpkg");
  }
  Ran simplify(const std::string& more) {
    return run_tind("simplify " + dir_.file("g.asc") + " --crs EPSG:32633 --max-error 1 -o " +
                    dir_.file("a.ply") + " --progress none" + more);
  }
  void expect_refused(const std::string& more, const std::string& why) {
    const Ran ran = simplify(more);
    EXPECT_EQ(ran.code, 2) << ran.out;
    EXPECT_NE(ran.out.find(why), std::string::npos) << ran.out;
    EXPECT_EQ(std::count(ran.out.begin(), ran.out.end(), '\n'), 1) << ran.out;
  }
  void expect_taken(const std::string& more) {
    const Ran ran = simplify(more);
    EXPECT_EQ(ran.code, 0) << ran.out;
    EXPECT_EQ(ran.out.find("warning"), std::string::npos) << ran.out;
  }
};

TEST_F(LineDatums, OfAnotherDatumThanTheDemAreRefused) {
  const std::string egm96 = " --from-datum egm96", to_ellipsoid = egm96 + " --to-datum ellipsoid";
  const std::string line = line_in("EPSG:32633+5773");
  expect_taken(egm96 + line);
  expect_refused(to_ellipsoid + line,
                 "line.geojson: says that its heights are above 'EGM96 height', and those of the "
                 "DEM, once converted, are above ellipsoid");
  expect_taken(to_ellipsoid + line + " --line-heights dem");
  expect_refused(egm96 + lake_in("EPSG:4937"),
                 "lake.gpkg: says that its heights are above ellipsoid, and those of the DEM are "
                 "above egm96");
  expect_taken(egm96 + " --boundary " + dir_.file("lake.gpkg"));  // whose heights do not count
  expect_taken(to_ellipsoid + " --flatten " + dir_.file("lake.gpkg"));
  expect_taken(egm96 + lake_in("EPSG:4326"));
  // What GDAL makes of GeoJSON says this, and who wrote that did not.
  const Ran unsaid = simplify(egm96 + lake_in("EPSG:4979"));
  EXPECT_EQ(unsaid.code, 0) << unsaid.out;
  EXPECT_NE(unsaid.out.find("by EPSG:4979, which ogr2ogr makes of any GeoJSON"), std::string::npos)
      << unsaid.out;
  // Above another ellipsoid than WGS84's.
  const Ran bessel = simplify(egm96 + lake_in("EPSG:9267"));
  EXPECT_EQ(bessel.code, 0) << bessel.out;
  EXPECT_NE(bessel.out.find("above 'the ellipsoid of MGI'"), std::string::npos) << bessel.out;
}

TEST_F(LineDatums, OfTheSameInAnotherUnitAreConverted) {
  const auto made = [&](const std::string& crs) {
    expect_taken(" --from-datum EPSG:5703" + line_in(crs));
    return test::tind_json("info " + dir_.file("a.ply") + " --json");
  };
  EXPECT_NEAR(made("EPSG:32633+5703")["high"][2].get<double>(), 300, 1e-3);
  EXPECT_NEAR(made("EPSG:32633+6360")["low"][2].get<double>(), 300 * 1200. / 3937, 1e-3);
}

TEST_F(LineDatums, AreDoubtedWhereTheDemHasNone) {
  const Ran ran = simplify(line_in("EPSG:32633+5773"));
  EXPECT_EQ(ran.code, 0) << ran.out;
  EXPECT_NE(ran.out.find("line.geojson are above 'EGM96 height', and of"), std::string::npos);
  EXPECT_NE(ran.out.find("nobody says above what"), std::string::npos) << ran.out;
  expect_taken(line_in("EPSG:32633"));
  expect_refused(line_in("EPSG:32633+5715"), "counts downwards");
}

}  // namespace
}  // namespace tind
