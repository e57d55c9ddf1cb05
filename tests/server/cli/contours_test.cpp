#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/program_json.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using nlohmann::json;
using test::run_tind;
using test::tind_json;

/// In metres (UTM), without a void.
std::string dem() { return test::testdata("bigtujunga_crop.tif"); }

json file(const std::string& path) {
  std::ifstream in(path);
  return json::parse(in, nullptr, false);
}

bool is_in_ring(const json& ring, double x, double y) {
  bool inside = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const double xi = ring[i][0], yi = ring[i][1], xj = ring[j][0], yj = ring[j][1];
    if ((yi > y) != (yj > y) && x < (xj - xi) * (y - yi) / (yj - yi) + xi) inside = !inside;
  }
  return inside;
}

bool is_in(const json& areas, double height, double x, double y) {
  for (const json& area : areas["features"]) {
    if (area["properties"]["height_m"] != height) continue;
    bool inside = false;  // of the first ring and of none of its holes
    for (const json& ring : area["geometry"]["coordinates"])
      inside = inside != is_in_ring(ring, x, y);
    if (inside) return true;
  }
  return false;
}

/// The corners of the DEM's own contours, which lie on its bilinear surface.
void expect_lines_inside(const json& lines, const json& areas) {
  std::size_t looked = 0, corners = 0;
  for (const json& line : lines["features"])
    for (const json& p : line["geometry"]["coordinates"]) {
      const double x = p[0], y = p[1];
      // At the rim GDAL's lines go on by half a pixel, beyond the outermost posts.
      if (x < -118.179 || x > -118.119 || y < 34.302 || y > 34.350 || ++corners % 7 != 0) continue;
      ++looked;
      ASSERT_TRUE(is_in(areas, line["properties"]["height_m"], x, y)) << x << ", " << y;
    }
  EXPECT_GT(looked, 200u);
}

TEST(Contours, OfAMeshAreInItsBands) {
  const test::TempDir dir;
  const std::string start = "contours " + dem() + " --interval 100 --json -o ";
  const std::string lines = dir.file("lines.geojson"), bands = dir.file("bands.geojson");
  const json drawn = tind_json(start + lines);
  EXPECT_EQ(drawn["lines"], file(lines)["features"].size());
  const json said = tind_json(start + bands + " --as-band --max-error 10");
  EXPECT_EQ(said["areas"], file(bands)["features"].size());
  EXPECT_GE(said["error_m"], 8);
  EXPECT_LE(said["error_m"], 10);
  EXPECT_LT(said["triangles"], 8000);
  EXPECT_EQ(file(bands)["features"][0]["properties"]["error_m"], said["error_m"]);
  expect_lines_inside(file(lines), file(bands));
}

TEST(Contours, OfAMeshAreWithinTheErrorThatWasAsked) {
  const test::TempDir dir;
  for (const double asked : {2.0, 0.5, 0.01}) {
    const json said = tind_json("contours " + dem() + " --interval 500 --as-band --json -o " +
                                dir.file("a.gpkg") + " --max-error " + std::to_string(asked));
    EXPECT_LE(said["error_m"], asked);
    EXPECT_GE(said["error_m"], 0.9 * asked);
  }
}

TEST(Contours, OfTilesAreInTheirBands) {
  const test::TempDir dir;
  const std::string input = dem() + " --from-datum egm96", tiles = dir.file("tiles");
  ASSERT_EQ(run_tind("build " + input + " -o " + tiles + " --levels 0-11").code, 0);
  const std::string lines = dir.file("lines.geojson"), bands = dir.file("bands.geojson");
  tind_json("contours " + input + " --to-datum ellipsoid --interval 200 --json -o " + lines);
  const json said = tind_json("contours " + input + " --interval 200 --as-band --tiles " + tiles +
                              " --level 11 --json -o " + bands);
  EXPECT_EQ(said["vertical_datum"], "ellipsoid");
  EXPECT_GT(said["error_m"], 1);
  EXPECT_LT(said["error_m"], 100);
  expect_lines_inside(file(lines), file(bands));
}

TEST(Contours, OfTilesAreAboveWhatTheTilesAre) {
  const test::TempDir dir;
  const std::string input = dem() + " --from-datum egm96", tiles = dir.file("tiles");
  ASSERT_EQ(run_tind("build " + input + " -o " + tiles + " --levels 0-9").code, 0);
  const std::string asked = "contours " + input + " --interval 500 --as-band --tiles " + tiles +
                            " --level 9 -o " + dir.file("a.gpkg");
  const auto warned = run_tind(asked);
  EXPECT_EQ(warned.code, 0);
  EXPECT_NE(warned.out.find("above ellipsoid, not above egm96"), std::string::npos) << warned.out;
  const auto other = run_tind(asked + " --to-datum egm96");
  EXPECT_EQ(other.code, 2) << other.out;
  EXPECT_EQ(run_tind(asked + " --to-datum ellipsoid").code, 0);
}

/// A hill of 400 m, whose top is 2.2 km from the north pole, in metres of EPSG:3413.
std::string hill_at_the_pole(const test::TempDir& dir) {
  const std::string path = dir.file("hill.asc");
  std::ofstream out(path);
  out << "ncols 61\nnrows 61\nxllcenter -28000\nyllcenter -29000\ncellsize 1000\n";
  for (int row = 0; row < 61; ++row)
    for (int col = 0; col < 61; ++col)
      out << 400 - 10 * std::hypot(col - 30, row - 30) << (col < 60 ? ' ' : '\n');
  return path;
}

/// Each line and each ring of a file, with its feature's height.
template <class Look>
void for_each_chain(const json& file, Look look) {
  for (const json& feature : file["features"]) {
    const std::string type = feature["geometry"]["type"];
    const json& parts = feature["geometry"]["coordinates"];
    const double height = feature["properties"]["height_m"];
    if (type == "LineString")
      look(parts, height);
    else if (type != "MultiPolygon")
      for (const json& part : parts) look(part, height);
    else
      for (const json& polygon : parts)
        for (const json& ring : polygon) look(ring, height);
  }
}

TEST(Contours, AroundAPoleStayOnTheMap) {
  const test::TempDir dir;
  const std::string lines = dir.file("lines.geojson"), bands = dir.file("bands.geojson");
  const std::string start =
      "contours " + hill_at_the_pole(dir) + " --crs EPSG:3413 --levels 250,376 --json -o ";
  EXPECT_EQ(tind_json(start + lines)["lines"], 2);
  EXPECT_EQ(tind_json(start + bands + " --as-band --max-error 5")["areas"], 2);
  const json drawn = file(lines), areas = file(bands);
  for (const json& made : {drawn, areas}) {
    std::size_t ends = 0;
    for_each_chain(made, [&](const json& chain, double) {
      for (std::size_t i = 0; i < chain.size(); ++i) {
        const double lon = chain[i][0];
        ends += std::abs(lon) == 180;
        EXPECT_LE(std::abs(lon), 180);
        if (i > 0) {
          EXPECT_LE(std::abs(lon - chain[i - 1][0].get<double>()), 180);
        }
      }
    });
    EXPECT_GE(ends, 4u);
  }
  for_each_chain(drawn, [&](const json& line, double height) {
    for (const json& p : line) {
      EXPECT_EQ(p[2], height);
      if (std::abs(p[0].get<double>()) == 180) continue;
      bool inside = false;
      for_each_chain(areas, [&](const json& ring, double of) {
        if (of == height) inside = inside != is_in_ring(ring, p[0], p[1]);
      });
      EXPECT_TRUE(inside) << p;
    }
  });
}

TEST(Contours, WhatNobodyCanDrawIsSaidInOneLine) {
  const test::TempDir dir;
  const std::string out = " -o " + dir.file("a.geojson");
  EXPECT_EQ(run_tind("contours " + dem() + " --interval 50 --base 1e300" + out).code, 2);
  EXPECT_EQ(run_tind("contours " + dem() + " --interval 1e-300" + out).code, 2);
  std::ofstream(dir.file("void.asc"))
      << "ncols 2\nnrows 2\nxllcorner 7\nyllcorner 46\ncellsize 1\nNODATA_value -9\n-9 -9 -9 -9\n";
  EXPECT_EQ(
      run_tind("contours " + dir.file("void.asc") + " --crs EPSG:4326 --interval 10" + out).code,
      65);
}

TEST(Contours, ABandSaysWhatItNeeds) {
  const test::TempDir dir;
  const std::string start = "contours " + dem() + " --interval 500 -o " + dir.file("a.gpkg");
  for (const char* const more :
       {" --as-band", " --max-error 5", " --tiles t --level 3", " --as-band --max-error 0",
        " --as-band --max-error 5 --tiles t --level 3"})
    EXPECT_EQ(run_tind(start + more).code, 2) << more;
}

}  // namespace
}  // namespace tind
