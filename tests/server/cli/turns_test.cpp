// Longitudes of lines and polygons against a DEM that counts them in another turn around the globe.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/program.h"

namespace tind {
namespace {

class Turns : public ::testing::Test {
 protected:
  /// `cols` x 4 posts a degree apart from (west, 10) to the north, all of 100 m.
  std::string dem(double west, int cols) {
    const std::string name = folder_.file(fmt::format("dem{}", west));
    std::ofstream out(name + ".asc");
    out << "ncols " << cols << "\nnrows 4\nxllcenter " << west
        << "\nyllcenter 10\ncellsize 1\nNODATA_value -1\n";
    for (int i = 0; i < 4 * cols; ++i) out << "100 ";
    out << "\n";
    std::ofstream(name + ".prj")
        << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
        << R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
    return name + ".asc";
  }
  static std::string box(double west, double east) {
    return fmt::format("[[[{0},10.5],[{1},10.5],[{1},12.5],[{0},12.5],[{0},10.5]]]", west, east);
  }
  std::uint64_t posts(const std::string& dem, const std::string& geometry) {
    const std::string file = folder_.file("area.geojson");
    std::ofstream(file) << R"({"type":"Feature","properties":{},"geometry":)" << geometry << "}";
    const auto ran = test::run_tind("statistics " + dem + " --polygons " + file + " --json");
    EXPECT_EQ(ran.code, 0) << ran.out;
    const auto said = nlohmann::json::parse(ran.answer, nullptr, false);
    return said.is_object() ? said["polygons"][0].value("posts", std::uint64_t(0)) : 0;
  }
  static std::string polygon(const std::string& rings) {
    return R"({"type":"Polygon","coordinates":)" + rings + "}";
  }

  const test::TempDir folder_;
};

/// Degrees of posts are rarely what a box says to the last bit.
TEST_F(Turns, PostsOnTheSidesOfABoxAreHalfInIt) {
  dem(0, 2);  // for its .prj
  for (const double west : {-121.9, 8.1, 46.7, 0.3}) {
    const std::string name = folder_.file(fmt::format("fine{}", west));
    std::ofstream out(name + ".asc");
    out << "ncols 40\nnrows 4\nxllcenter " << west << "\nyllcenter 10\ncellsize 0.01\n";
    for (int i = 0; i < 160; ++i) out << "100 ";
    out.close();
    std::filesystem::copy(folder_.file("dem0.prj"), name + ".prj");
    for (const double from : {0.1, 0.07, 0.13})
      EXPECT_EQ(posts(name + ".asc",
                      polygon(fmt::format("[[[{0:.2f},10.005],[{1:.2f},10.005],[{1:.2f},10.025],"
                                          "[{0:.2f},10.025],[{0:.2f},10.005]]]",
                                          west + from, west + from + 0.2))),
                40u)
          << west << " " << from;
  }
}

TEST_F(Turns, APolygonCountsWhereItsLongitudesCome) {
  const std::string globe = dem(0, 360), strip = dem(175, 10);  // to 184
  EXPECT_EQ(posts(globe, polygon(box(-108.5, -102.5))), 12u);
  EXPECT_EQ(posts(globe, polygon(box(251.5, 257.5))), 12u);
  EXPECT_EQ(posts(globe, polygon(box(-2.5, 2.5))), 10u);  // across the seam
  EXPECT_EQ(posts(globe, polygon(box(-180, 180))), 720u);
  EXPECT_EQ(posts(strip, polygon(box(-178.5, -176.5))), 4u);
  EXPECT_EQ(posts(strip, polygon(box(177.5, 182.5))), 10u);
  // The step from 177.5 to -177.5 is the shorter way; cut at 180 is how RFC 7946 has it.
  EXPECT_EQ(posts(strip, polygon(box(177.5, -177.5))), 10u);
  EXPECT_EQ(posts(strip, R"({"type":"MultiPolygon","coordinates":[)" + box(177.5, 180) + "," +
                             box(-180, -177.5) + "]}"),
            10u);
}

TEST_F(Turns, AHoleStaysInItsPolygon) {
  const std::string strip = dem(175, 10);
  const std::string outer = box(177.5, 183.5), hole = box(-179.5, -178.5);
  EXPECT_EQ(posts(strip, polygon("[" + outer.substr(1, outer.size() - 2) + "," +
                                 hole.substr(1, hole.size() - 2) + "]")),
            10u);
}

TEST_F(Turns, APolygonElsewhereIsStillRefused) {
  const std::string strip = dem(175, 10), file = folder_.file("area.geojson");
  std::ofstream(file) << polygon(box(10, 20));
  const auto ran = test::run_tind("statistics " + strip + " --polygons " + file);
  EXPECT_EQ(ran.code, 65) << ran.out;
}

}  // namespace
}  // namespace tind
