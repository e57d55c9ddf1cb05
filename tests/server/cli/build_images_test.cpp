// The program itself: `tind build --format rgb` and the like.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "terrain/base/file_io.h"
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

TEST(BuildImages, UndeclaredNodataIsTold) {
  const test::TempDir dir;
  std::ofstream(dir.file("a.asc")) << "ncols 3\nnrows 2\nxllcenter 7\nyllcenter 46\ncellsize 0.01\n"
                                      "1 -9999 3\n4 5 6\n";
  const auto ran =
      test::run_tind("build " + dir.file("a.asc") + " --crs EPSG:4326 --format rgb -o " +
                     dir.file("images") + " --progress none");
  EXPECT_EQ(ran.code, 0);
  EXPECT_NE(ran.out.find("1 post is -9999"), std::string::npos) << ran.out;
  // What shapes meshes only would make images of another version without a difference.
  EXPECT_EQ(test::run_tind("build " + dir.file("a.asc") + " --crs EPSG:4326 --format rgb --water " +
                           dir.file("w.geojson") + " -o " + dir.file("images"))
                .code,
            2);
}

TEST(BuildImages, LevelsOfAnEarlierRunStayInTheDescription) {
  const test::TempDir dir;
  const auto levels = [&](const char* asked) {
    EXPECT_EQ(test::run_tind("build " + test::testdata("desert.asc") + " --format rgb --levels " +
                             asked + " --progress none -o " + dir.file("i"))
                  .code,
              0);
    const auto json = nlohmann::json::parse(*read_whole_file(dir.file("i") + "/tiles.json"));
    return std::pair<int, int>(json["minzoom"], json["maxzoom"]);
  };
  EXPECT_EQ(levels("0-1"), std::pair(0, 1));
  EXPECT_EQ(levels("3-4"), std::pair(3, 4)) << "level 2 is not there";
  EXPECT_EQ(levels("2-2"), std::pair(0, 4));
  EXPECT_EQ(levels("1-2"), std::pair(0, 4));
}

TEST(BuildImages, ForceTakesAwayOnlyWhereImagesWere) {
  const test::TempDir dir;
  std::ofstream dem(dir.file("a.asc"));  // across the antimeridian
  dem << "ncols 21\nnrows 5\nxllcenter 179\nyllcenter 46\ncellsize 0.1\n";
  for (int i = 0; i < 105; ++i) dem << i << ((i + 1) % 21 ? " " : "\n");
  dem.close();
  const std::string line = "build " + dir.file("a.asc") + " --crs EPSG:4326 --levels 0-3 -o " +
                           dir.file("i") + " --progress none --format ";
  ASSERT_EQ(test::run_tind(line + "rgb").code, 0);
  const std::string mine = dir.file("i") + "/3/4/2.png", theirs = dir.file("i") + "/3/0/2.png";
  std::filesystem::create_directories(dir.file("i") + "/3/4");
  std::ofstream(mine) << "mine";
  ASSERT_TRUE(std::filesystem::exists(theirs));
  EXPECT_EQ(test::run_tind(line + "terrarium").code, 2);
  ASSERT_EQ(test::run_tind(line + "terrarium --force").code, 0);
  EXPECT_EQ(read_whole_file(mine).value_or(""), "mine") << "0 to 45 degrees east";
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
