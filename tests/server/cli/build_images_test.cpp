// The program itself: `tind build --format rgb` and the like.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/program.h"

namespace tind {
namespace {

TEST(BuildImages, BeyondWebMapsWarns) {
  const test::TempDir dir;
  const auto built_at = [&](const std::string& south) {
    const std::string dem = dir.file("dem" + south + ".asc");
    std::ofstream(dem) << "ncols 4\nnrows 4\nxllcorner 10\nyllcorner " << south
                       << "\ncellsize 0.01\n1 2 3 4\n2 3 4 5\n3 4 5 6\n4 5 6 7\n";
    std::ofstream(dir.file("dem" + south + ".prj"))
        << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
        << R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
    return test::run_tind("build " + dem + " --format rgb --levels 0-2 --progress none -o " +
                          dir.file("images" + south));
  };
  const auto beyond = built_at("86");
  EXPECT_EQ(beyond.code, 0) << beyond.out;
  EXPECT_NE(beyond.out.find("warning: there is no image"), std::string::npos) << beyond.out;
  const auto within = built_at("85.04");  // across it
  EXPECT_EQ(within.code, 0) << within.out;
  EXPECT_EQ(within.out.find("warning: there is no image"), std::string::npos) << within.out;
}

TEST(BuildImages, OfADemThatHasNoPlaceAreNotMade) {
  const test::TempDir dir;
  for (const std::string format : {"rgb", "terrarium", "hillshade", "slope", "aspect"}) {
    const auto ran = test::run_tind("build " + test::testdata("crater.tif") + " --format " +
                                    format + " --levels 0-1 -o " + dir.file("images"));
    EXPECT_EQ(ran.code, 65) << format;
    EXPECT_NE(ran.out.find("no coordinate reference system"), std::string::npos) << ran.out;
    EXPECT_TRUE(std::filesystem::is_empty(dir.file("images")));
  }
}

TEST(BuildImages, AFolderHoldsOneFormat) {
  const test::TempDir dir;
  const auto build = [&](const std::string& format, const std::string& folder) {
    return test::run_tind("build " + test::testdata("desert.asc") + " --levels 0-1 --format " +
                          format + " --progress none -o " + dir.file(folder));
  };
  ASSERT_EQ(build("rgb", "images").code, 0);
  ASSERT_EQ(build("quantized-mesh", "meshes").code, 0);
  const auto meshes = build("quantized-mesh", "images"), images = build("rgb", "meshes");
  EXPECT_EQ(meshes.code, 2) << meshes.out;
  EXPECT_NE(meshes.out.find("(tind-images.json): choose another"), std::string::npos) << meshes.out;
  EXPECT_FALSE(std::filesystem::exists(dir.file("images") + "/layer.json"));
  EXPECT_EQ(images.code, 2) << images.out;
}

TEST(BuildImages, OfADemWhoseNameIsNoUtf8AreMade) {
  const test::TempDir dir;
  const std::string dem = dir.file("na\xffme.asc"), out = dir.file("images");
  std::ofstream(dem)
      << "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 45\ncellsize 0.01\n1 2 3\n4 5 6\n";
  const auto ran = test::run_tind(
      "build '" + dem + "' --crs EPSG:4326 --format rgb --levels 0-1 --progress none -o " + out);
  EXPECT_EQ(ran.code, 0) << ran.out;
  EXPECT_TRUE(std::filesystem::exists(out + "/tiles.json"));
}

TEST(BuildImages, OfNothingAreNotMade) {
  const test::TempDir dir;
  const std::string dem = dir.file("dem.asc"), out = dir.file("images");
  std::ofstream(dem) << "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 45\ncellsize 0.01\n"
                     << "NODATA_value -1\n-1 -1 -1\n-1 -1 -1\n";
  std::ofstream(dir.file("dem.prj"))
      << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
      << R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
  for (const std::string format : {"rgb", "terrarium", "hillshade", "slope", "aspect"}) {
    const auto ran =
        test::run_tind("build " + dem + " --format " + format + " --progress none -o " + out);
    EXPECT_EQ(ran.code, 65) << format << ": " << ran.out;
    EXPECT_NE(ran.out.find("no valid height"), std::string::npos) << ran.out;
    EXPECT_TRUE(std::filesystem::is_empty(out)) << format;
  }
}

}  // namespace
}  // namespace tind
