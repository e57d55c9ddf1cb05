// The program itself: --breaklines, --flatten and --boundary, through every method.

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "terrain/mesh/constrained_delaunay.h"
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

}  // namespace
}  // namespace tind
