#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/program_json.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using nlohmann::json;
using test::run_tind;
using test::tind_json;

constexpr const char* kWhere = " --bounds=-121.8,46.8,-121.7,46.9";

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
      if (x < -121.799 || x > -121.701 || y < 46.801 || y > 46.899 || ++corners % 7 != 0) continue;
      ++looked;
      ASSERT_TRUE(is_in(areas, line["properties"]["height_m"], x, y)) << x << ", " << y;
    }
  EXPECT_GT(looked, 200u);
}

TEST(Contours, OfAMeshAreInItsBands) {
  const test::TempDir dir;
  const std::string start = "contours " + test::testdata("rainier.tif") + kWhere;
  const std::string lines = dir.file("lines.geojson"), bands = dir.file("bands.geojson");
  const json drawn = tind_json(start + " --interval 250 --json -o " + lines);
  EXPECT_EQ(drawn["lines"], file(lines)["features"].size());
  const json said = tind_json(start + " --interval 250 --band --max-error 20 --json -o " + bands);
  EXPECT_EQ(said["areas"], file(bands)["features"].size());
  EXPECT_GE(said["error_m"], 10);
  EXPECT_LE(said["error_m"], 60);  // between posts, too
  EXPECT_LT(said["triangles"], 5000);
  EXPECT_EQ(file(bands)["features"][0]["properties"]["error_m"], said["error_m"]);
  expect_lines_inside(file(lines), file(bands));
}

TEST(Contours, OfTilesAreInTheirBands) {
  const test::TempDir dir;
  const std::string dem = test::testdata("rainier.tif"), tiles = dir.file("tiles");
  ASSERT_EQ(run_tind("build " + dem + " -o " + tiles + " --levels 0-9").code, 0);
  const std::string lines = dir.file("lines.geojson"), bands = dir.file("bands.geojson");
  tind_json("contours " + dem + kWhere + " --to-datum ellipsoid --interval 500 --json -o " + lines);
  const json said = tind_json("contours " + dem + kWhere + " --interval 500 --band --tiles " +
                              tiles + " --level 9 --json -o " + bands);
  EXPECT_EQ(said["vertical_datum"], "ellipsoid");
  EXPECT_GT(said["error_m"], 1);
  expect_lines_inside(file(lines), file(bands));
}

TEST(Contours, ABandSaysWhatItNeeds) {
  const test::TempDir dir;
  const std::string start =
      "contours " + test::testdata("rainier.tif") + " --interval 500 -o " + dir.file("a.gpkg");
  for (const char* const more :
       {" --band", " --max-error 5", " --tiles t --level 3", " --band --max-error 0",
        " --band --max-error 5 --tiles t --level 3"})
    EXPECT_EQ(run_tind(start + more).code, 2) << more;
}

}  // namespace
}  // namespace tind
