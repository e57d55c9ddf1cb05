// The program itself: `tind build --format flightgear` with land cover.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/program.h"

namespace tind {
namespace {

class BuildScenery : public ::testing::Test {
 protected:
  test::TempDir dir_;

  /// Whole numbers in an area of 0.04 degrees.
  std::string raster(const std::string& name, const std::string& numbers) {
    std::ofstream(dir_.file(name + ".asc")) << "ncols 4\nnrows 2\nxllcorner 10.01\nyllcorner 45.01"
                                            << "\ncellsize 0.01\n"
                                            << numbers << "\n";
    std::ofstream(dir_.file(name + ".prj"))
        << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
        << R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
    return dir_.file(name + ".asc");
  }
  test::Ran build(const std::string& options) {
    return test::run_tind("build " + raster("dem", "1 2 3 4\n2 3 4 5") + " --progress none -o " +
                          dir_.file("out") + " " + options);
  }
  std::size_t files() const {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(dir_.file("out")))
      count += entry.is_regular_file();
    return count;
  }
  bool there() const { return std::filesystem::exists(dir_.file("out")); }
};

TEST_F(BuildScenery, SaysWhichClassesHaveNoMaterial) {
  const std::string cover = raster("cover", "10 10 20 20\n10 10 20 20");
  const auto none = build("--format flightgear --land-cover " + cover);
  EXPECT_EQ(none.code, 2) << none.out;
  EXPECT_NE(none.out.find("10, 20"), std::string::npos) << none.out;
  EXPECT_FALSE(there());
  const auto some = build("--format flightgear --materials 10=Town --land-cover " + cover);
  EXPECT_EQ(some.code, 0) << some.out;
  EXPECT_NE(some.out.find(": 20"), std::string::npos) << some.out;
  const std::string other = "--format flightgear --materials worldcover --land-cover " + cover;
  EXPECT_EQ(build(other).code, 2) << "in place of those of before only with --force";
  const auto all = build(other + " --force");
  EXPECT_EQ(all.code, 0) << all.out;
  EXPECT_EQ(all.out.find("--materials"), std::string::npos) << all.out;
  EXPECT_NE(all.out.find("0 kept"), std::string::npos) << "others of before were kept: " << all.out;
}

TEST_F(BuildScenery, RefusesWhatFitsNothing) {
  const std::string cover = raster("cover", "10 10 20 20\n10 10 20 20");
  for (const std::string& options :
       {std::string("--format flightgear --materials worldcover"),
        "--format flightgear --drape " + cover, "--materials worldcover --land-cover " + cover,
        "--format 3dtiles --materials worldcover --land-cover " + cover,
        "--format flightgear --materials 10=no,such --land-cover " + cover,
        "--format rgb --land-cover " + cover}) {
    const auto ran = build(options);
    EXPECT_EQ(ran.code, 2) << options << ": " << ran.out;
    EXPECT_FALSE(there()) << options;
  }
}

TEST_F(BuildScenery, HearsNothingThatShapesTilesOnly) {
  for (const char* option : {"--exact-posts 100", "--breaklines b.geojson", "--levels 0-3"})
    EXPECT_EQ(build(std::string("--format flightgear ") + option).code, 2) << option;
}

TEST_F(BuildScenery, OfNothingIsNotMade) {
  const std::string voids = raster("voids", "NODATA_value -1\n-1 -1 -1 -1\n-1 -1 -1 -1");
  const std::string to = " --format flightgear --progress none -o " + dir_.file("out");
  const auto fresh = test::run_tind("build " + voids + to);
  EXPECT_EQ(fresh.code, 65) << fresh.out;
  EXPECT_NE(fresh.out.find("no valid height"), std::string::npos) << fresh.out;
  EXPECT_TRUE(std::filesystem::is_empty(dir_.file("out")));
  EXPECT_EQ(build("--format flightgear").code, 0);
  const std::size_t before = files();
  EXPECT_GT(before, 2u);
  EXPECT_EQ(test::run_tind("build " + voids + to).code, 65);
  EXPECT_EQ(files(), before) << "scenery of before was taken away for nothing";
}

}  // namespace
}  // namespace tind
