// tind export as its users run it: what it refuses, and that nothing is lost then.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "terrain/base/file_io.h"
#include "tests/support/program.h"

namespace tind {
namespace {

using test::run_tind;

class Export : public ::testing::Test {
 protected:
  const test::TempDir folder_;
  const std::string dem_ = test::testdata("rainier.tif");
};

TEST_F(Export, RefusesWhatNoEngineTakesAndNamesWhatOneDoes) {
  const std::string out = folder_.file("a.png");
  for (const std::string& line : std::vector<std::string>{
           "--format unreal --size 2000 -o " + out,
           "--format unreal --size 2017x1000 -o " + out,
           "--format unity --size 1009 -o " + folder_.file("a.raw"),
           "--format unity --size 1025x513 -o " + folder_.file("a.raw"),
           "--format unreal -o " + folder_.file("a.tif"),
           "--format unity -o " + out,
           "--format unreal --byte-order big -o " + out,
           "--format unreal --lod 3 -o " + out,
           "--format cdb --size 1009 -o " + folder_.file("cdb"),
           "--format cdb --water lake.geojson -o " + folder_.file("cdb"),
           "--format unreal --breaklines lake.geojson -o " + out,
           "--format unreal --bounds 1,2,1,3 -o " + out,
           "--format unreal --heights 5,5 -o " + out,
           "--format unreal --to-crs EPSG:4326 -o " + out,
           "--format dted -o " + out,
           "--format unreal",
       }) {
    const auto ran = run_tind("export " + dem_ + " " + line);
    EXPECT_EQ(ran.code, 2) << line << '\n' << ran.out;
    EXPECT_EQ(ran.answer, "") << line;
  }
  EXPECT_NE(run_tind("export " + dem_ + " --format unreal --size 2000 -o " + out).out.find("2017"),
            std::string::npos);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(Export, OfADemThatHasNoPlaceIsRefused) {
  for (const std::string& to :
       std::vector<std::string>{"--format unity -o " + folder_.file("a.raw"),
                                "--format unreal -o " + folder_.file("a.png"),
                                "--format cdb -o " + folder_.file("cdb")}) {
    const auto ran = run_tind("export " + test::testdata("crater.tif") + " " + to);
    EXPECT_EQ(ran.code, 65) << to;
    EXPECT_NE(ran.out.find("no coordinate reference system"), std::string::npos) << ran.out;
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(Export, NeverWritesOverItsInput) {
  const std::string copy = folder_.file("dem.png"), before = *read_whole_file(dem_);
  std::filesystem::copy_file(dem_, copy);
  EXPECT_EQ(run_tind("export " + copy + " --format unreal -o " + copy).code, 2);
  EXPECT_EQ(run_tind("export --layer a=" + copy + " --format unreal -o " + copy).code, 2);
  EXPECT_EQ(*read_whole_file(copy), before);
}

TEST_F(Export, TheReportIsPrintedAndLiesBeside) {
  const std::string out = folder_.file("a.r16");
  const auto ran = run_tind("export " + dem_ + " --format unreal --size 127 --json -o " + out);
  ASSERT_EQ(ran.code, 0) << ran.out;
  const auto report = nlohmann::json::parse(ran.answer);
  EXPECT_EQ(report, nlohmann::json::parse(*read_whole_file(out + ".json")));
  EXPECT_EQ(std::filesystem::file_size(out), 2u * 127 * 127);
  EXPECT_EQ(report["vertical_datum"], "egm96");
  EXPECT_GT(report["samples_of_each_post"], 1);
}

TEST_F(Export, BoundsMayCrossTheAntimeridian) {
  const std::string dem = folder_.file("dem.asc"), out = folder_.file("a.raw");
  std::ofstream text(dem);
  text << "ncols 81\nnrows 41\nxllcorner 179.9595\nyllcorner 9.9795\ncellsize 0.001\n";
  for (int row = 0; row < 41; ++row)
    for (int col = 0; col < 81; ++col) text << 10 * col << (col < 80 ? ' ' : '\n');
  text.close();
  const std::string start =
      "export " + dem + " --crs EPSG:4326 --from-datum ellipsoid --bounds 179.98,9.985,";
  std::string before;
  for (const std::string east : {"180.02", "-179.98"}) {
    const auto ran =
        run_tind(start + east + ",10.015 --format unity --size 33 --fit inside --json " +
                 "--first-row north -o " + out);
    ASSERT_EQ(ran.code, 0) << ran.out;
    const auto report = nlohmann::json::parse(ran.answer);
    EXPECT_EQ(report["share_without_height"], 0);
    EXPECT_NEAR(std::abs(report["place"]["middle"][0].get<double>()), 180, 1e-6);
    EXPECT_NEAR(report["lowest_m"].get<double>(), 248, 20);
    EXPECT_NEAR(report["highest_m"].get<double>(), 552, 20);
    const std::string bytes = *read_whole_file(out);
    const auto value = [&](std::size_t i) {
      return std::uint8_t(bytes[2 * i]) + 256 * std::uint8_t(bytes[2 * i + 1]);
    };
    for (std::size_t col = 1; col < 33; ++col) EXPECT_GT(value(col), value(col - 1));
    if (!before.empty()) {
      EXPECT_EQ(bytes, before);
    }
    before = bytes;
  }
  const auto cdb =
      run_tind(start + "-179.98,10.015 --format cdb --lod -3 -o " + folder_.file("cdb"));
  ASSERT_EQ(cdb.code, 0) << cdb.out;
  for (const char* cell : {"N09/E179", "N09/W180", "N10/E179", "N10/W180"})
    EXPECT_TRUE(std::filesystem::exists(folder_.file("cdb/Tiles/") + cell)) << cell;
  EXPECT_FALSE(std::filesystem::exists(folder_.file("cdb/Tiles/N09/E178")));
}

TEST_F(Export, OfNoHeightAtAllFails) {
  const std::string dem = folder_.file("void.asc");
  std::ofstream text(dem);
  text << "ncols 9\nnrows 9\nxllcorner 7\nyllcorner 46\ncellsize 0.01\nNODATA_value -9999\n";
  for (int i = 0; i < 81; ++i) text << "-9999 ";
  text.close();
  const std::string start = "export " + dem + " --crs EPSG:4326 --from-datum ellipsoid --format ";
  EXPECT_EQ(run_tind(start + "unreal --size 127 -o " + folder_.file("a.png")).code, 65);
  for (int run = 0; run < 2; ++run) {  // the second one finds what the first one left
    const auto cdb = run_tind(start + "cdb --lod -8 -o " + folder_.file("cdb"));
    EXPECT_EQ(cdb.code, 65) << cdb.out;
    EXPECT_TRUE(std::filesystem::is_empty(folder_.file("cdb"))) << "another DEM may go there";
  }
}

TEST_F(Export, LevelsOfCdbAreWhatIsAskedFor) {
  const auto ran =
      run_tind("export " + dem_ + " --format cdb --lod -6 --json -o " + folder_.file("cdb"));
  ASSERT_EQ(ran.code, 0) << ran.out;
  const auto report = nlohmann::json::parse(ran.answer);
  EXPECT_EQ(report["deepest_level"], -6);
  EXPECT_EQ(report["tiles"], 5);
  EXPECT_EQ(report["vertical_datum"], "ellipsoid");
}

TEST_F(Export, OfOnePostSaysThatItHasNoArea) {
  const std::string dem = folder_.file("one.asc");
  std::ofstream(dem) << "ncols 1\nnrows 1\nxllcorner 7\nyllcorner 46\ncellsize 0.01\n5\n";
  const std::string start = "export " + dem + " --crs EPSG:4326 --from-datum ellipsoid --format ";
  const auto cdb = run_tind(start + "cdb -o " + folder_.file("cdb"));
  EXPECT_EQ(cdb.code, 2) << cdb.out;
  EXPECT_NE(cdb.out.find("one column or one row"), std::string::npos) << cdb.out;
  EXPECT_EQ(cdb.out.find("--bounds"), std::string::npos) << cdb.out;
  const auto map = run_tind(start + "unreal -o " + folder_.file("a.png"));
  EXPECT_EQ(map.code, 2) << map.out;
  EXPECT_NE(map.out.find("no width or no height"), std::string::npos) << map.out;
  // Of one row as well, though a parallel is no line on the map.
  std::ofstream row(dem);
  row << "ncols 40\nnrows 1\nxllcorner 7\nyllcorner 46\ncellsize 0.01\n";
  for (int i = 0; i < 40; ++i) row << i << ' ';
  row.close();
  EXPECT_EQ(run_tind(start + "unreal -o " + folder_.file("a.png")).code, 2);
}

TEST_F(Export, ASpacingThatNoSideCoversIsRefused) {
  const std::string start = "export " + dem_ + " --format ";
  const auto fine = run_tind(start + "unity --spacing 1 -o " + folder_.file("a.raw"));
  EXPECT_EQ(fine.code, 2) << fine.out;
  EXPECT_NE(fine.out.find("do not cover"), std::string::npos) << fine.out;
  const auto coarse =
      run_tind(start + "unreal --spacing 1000 --fit inside -o " + folder_.file("a.png"));
  EXPECT_EQ(coarse.code, 2) << coarse.out;
  EXPECT_NE(coarse.out.find("do not lie inside"), std::string::npos) << coarse.out;
  const auto map =
      run_tind(start + "unity --to-crs EPSG:3857 --size 33 -o " + folder_.file("a.raw"));
  EXPECT_EQ(map.code, 0);
  EXPECT_NE(map.out.find("lengths on the ground differ by up to"), std::string::npos) << map.out;
}

/// Its columns lead to the west, and its rows to the north, or the other way about.
TEST_F(Export, OfAxesToTheWestAndTheSouthLiesInsideToo) {
  const std::string dem = folder_.file("axes.asc");
  const auto maps = [&](const std::string& corner, const std::string& crs) {
    std::ofstream out(dem);
    out << "ncols 40\nnrows 40\n" << corner << "\ncellsize 10\n";
    for (int i = 0; i < 1600; ++i) out << i % 40 << ' ';
    out.close();
    const auto ran = run_tind("export " + dem + " --crs " + crs +
                              " --format unity --fit inside -o " + folder_.file("a.raw"));
    EXPECT_EQ(ran.code, 0) << crs << '\n' << ran.out;
  };
  maps("xllcorner -50000\nyllcorner 3000000", "EPSG:2053");
  maps("xllcorner 1050000\nyllcorner 600000", "EPSG:2065");
}

}  // namespace
}  // namespace tind
