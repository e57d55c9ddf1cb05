// tind slope, aspect, hillshade, tri and relief as their users run them: what is said of the plane
// that they are computed in, and of DEMs that have nothing to show.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/program_json.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::Ran;
using test::run_tind;
using test::tind_json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kDerivatives[] = {"slope", "aspect", "hillshade", "roughness", "tri", "tpi"};

class Derivatives : public ::testing::Test {
 protected:
  const test::TempDir dir_;

  /// Rises by 6 m a column, but for the first post, if that is said.
  std::string dem(double x, double y, double step, const std::string& first = "") const {
    const std::string path = dir_.file("dem.asc");
    std::ofstream out(path);
    out << "ncols 20\nnrows 20\nxllcorner " << x << "\nyllcorner " << y << "\ncellsize " << step
        << "\nNODATA_value -9999\n";
    for (int i = 0; i < 400; ++i)
      out << (i == 0 && !first.empty() ? first : std::to_string(100 + 6 * (i % 20))) << ' ';
    return path;
  }
  std::string flat(const std::string& number) const {
    const std::string path = dir_.file("flat.asc");
    std::ofstream out(path);
    out << "ncols 6\nnrows 6\nxllcorner 10\nyllcorner 46\ncellsize 0.001\nNODATA_value -9999\n";
    for (int i = 0; i < 36; ++i) out << number << ' ';
    return path + " --crs EPSG:4326";
  }
  std::string to(const std::string& name) const { return " -o " + dir_.file(name); }
};

TEST_F(Derivatives, OfWebMercatorSayThatTheirLengthsAreNotTheGrounds) {
  const std::string input = dem(1113194, 5780000, 20) + " --crs EPSG:3857";
  const auto warned = AllOf(HasSubstr("warning: "), HasSubstr("1.44 times those on the ground"));
  EXPECT_THAT(run_tind("slope " + input + to("a.tif")).out,
              AllOf(warned, HasSubstr("slopes are those in the plane of")));
  EXPECT_THAT(run_tind("hillshade " + input + to("a.tif")).out, warned);
  EXPECT_THAT(run_tind("relief " + input + to("a.png")).out, warned);
  // It turns nothing, and heights are heights.
  for (const char* const kind : {"aspect", "roughness", "tri", "tpi"}) {
    const Ran ran = run_tind(kind + (" " + input) + to("a.tif"));
    EXPECT_EQ(ran.code, 0) << ran.out;
    EXPECT_THAT(ran.out, Not(HasSubstr("plane of"))) << kind;
  }
  const auto said = tind_json("slope " + input + to("a.tif") + " --json --progress none");
  EXPECT_NEAR(said["length_scale"]["least"], 1.4396, 0.01);
  EXPECT_FALSE(tind_json("tri " + input + to("a.tif") + " --json").contains("length_scale"));
}

TEST_F(Derivatives, OfUtmAndOfDegreesAreThoseOnTheGround) {
  for (const std::string& input :
       {dem(500000, 5100000, 20) + " --crs EPSG:32632", dem(10, 46, 0.001) + " --crs EPSG:4326"}) {
    EXPECT_THAT(run_tind("slope " + input + to("a.tif")).out, Not(HasSubstr("plane of")));
    EXPECT_THAT(run_tind("relief " + input + to("a.tif")).out, Not(HasSubstr("plane of")));
  }
}

TEST_F(Derivatives, OfAProjectionThatStretchesOneDirectionSayThatAspectsAreTurned) {
  const std::string input = dem(1113194, 5120000, 20) + " --crs EPSG:4087";
  EXPECT_THAT(run_tind("aspect " + input + to("a.tif")).out,
              AllOf(HasSubstr("directions are those in the plane of"), HasSubstr("as long in")));
}

TEST_F(Derivatives, OfADemWithoutAnyHeightAreRefused) {
  const std::string input = flat("-9999");
  const auto refused = [&](const std::string& command, const std::string& name) {
    const Ran ran = run_tind(command + " " + input + to(name));
    EXPECT_EQ(ran.code, 65) << command;
    EXPECT_THAT(ran.out, HasSubstr("flat.asc: no post has a height")) << command;
    EXPECT_FALSE(std::filesystem::exists(dir_.file(name))) << command;
  };
  for (const char* const kind : kDerivatives) refused(kind, "a.tif");
  refused("relief", "a.png");
  refused("relief --low 0 --high 9", "a.tif");
  refused("contours --interval 10", "a.geojson");
}

TEST_F(Derivatives, OfFlatLandAre) {
  const std::string input = flat("5");
  for (const char* const kind : kDerivatives)
    EXPECT_EQ(run_tind(kind + (" " + input) + to("a.tif")).code, 0) << kind;
  EXPECT_EQ(run_tind("relief " + input + to("a.png")).code, 0);
}

TEST_F(Derivatives, OfAHeightThatNoGroundHasSayItAsTheFileDoes) {
  // 60000 half-metres above 100 m.
  const std::string input =
      dem(500000, 5100000, 20, "60000") + " --crs EPSG:32632 --scale 0.5 --offset 100";
  const Ran ran = run_tind("slope " + input + to("a.tif") + " --progress none");
  EXPECT_EQ(ran.code, 65);
  EXPECT_THAT(ran.out, AllOf(HasSubstr("a height of 30100 m, 60000 as the file has it,"),
                             HasSubstr("say --nodata 60000,")));
  EXPECT_THAT(ran.out, Not(HasSubstr("dem.asc: " + dir_.file("dem.asc"))));
  EXPECT_EQ(std::ranges::count(ran.out, '\n'), 1) << ran.out;
  EXPECT_EQ(run_tind("slope " + input + " --nodata 60000" + to("a.tif")).code, 0);
  EXPECT_THAT(run_tind("slope " + input + " --nodata -5" + to("a.tif")).out,
              HasSubstr("say --nodata -5,60000,"));
}

TEST_F(Derivatives, OfAHeightThatNoGroundHasSayItInTheUnitOfTheFile) {
  dem(500000, 5100000, 20, "60000");
  std::ofstream(dir_.file("feet.vrt"))
      << "<VRTDataset rasterXSize=\"20\" rasterYSize=\"20\"><SRS>EPSG:32632</SRS>"
      << "<GeoTransform>500000, 20, 0, 5100400, 0, -20</GeoTransform>"
      << "<VRTRasterBand dataType=\"Float32\" band=\"1\"><UnitType>ft</UnitType><SimpleSource>"
      << "<SourceFilename relativeToVRT=\"1\">dem.asc</SourceFilename><SourceBand>1</SourceBand>"
      << "</SimpleSource></VRTRasterBand></VRTDataset>";
  const std::string input = dir_.file("feet.vrt") + " --allow-vrt";
  EXPECT_THAT(run_tind("slope " + input + to("a.tif")).out,
              AllOf(HasSubstr("a height of 18288 m, 60000 as the file has it,"),
                    HasSubstr("say --nodata 60000,")));
  EXPECT_EQ(run_tind("slope " + input + " --nodata 60000" + to("a.tif")).code, 0);
}

TEST_F(Derivatives, OfANumberOf64BitsSayItWithAllItsDigits) {
  const std::string least = "-9.223372036854776e+18";
  dem(500000, 5100000, 20, least);
  std::ofstream(dir_.file("whole.vrt"))
      << "<VRTDataset rasterXSize=\"20\" rasterYSize=\"20\"><SRS>EPSG:32632</SRS>"
      << "<GeoTransform>500000, 20, 0, 5100400, 0, -20</GeoTransform>"
      << "<VRTRasterBand dataType=\"Int64\" band=\"1\"><SimpleSource>"
      << "<SourceFilename relativeToVRT=\"1\">dem.asc</SourceFilename><SourceBand>1</SourceBand>"
      << "</SimpleSource></VRTRasterBand></VRTDataset>";
  for (const std::string scale : {"", " --scale 0.1"}) {
    const std::string input = dir_.file("whole.vrt") + " --allow-vrt" + scale;
    const Ran ran = run_tind("slope " + input + to("a.tif"));
    EXPECT_EQ(ran.code, 65) << scale;
    EXPECT_THAT(ran.out, HasSubstr("say --nodata " + least + ",")) << scale;
    EXPECT_EQ(run_tind("slope " + input + " --nodata=" + least + to("a.tif")).code, 0) << scale;
  }
}

}  // namespace
}  // namespace tind
