// What a command prints arrives, or the command fails.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "server/cli/options/output_turn.h"
#include "terrain/base/file_io.h"
#include "tests/support/program.h"
#include "tests/support/program_json.h"

namespace tind {
namespace {

using test::run_tind;

TEST(Output, a_full_device_is_a_failure_of_every_command_that_prints) {
  const test::TempDir folder;
  const std::string dem = test::testdata("desert.asc"), tiles = folder.file("tiles");
  ASSERT_EQ(run_tind("build " + dem + " -o " + tiles + " --levels 0-3").code, 0);
  for (const std::string& command :
       std::vector<std::string>{"methods", "methods --json", "info " + dem, "info --json " + dem,
                                "check --json " + tiles, "check --rules",
                                "build --json " + dem + " -o " + tiles + " --levels 0-3",
                                "build " + dem + " -o " + tiles + " --levels 0-3",
                                "estimate --json " + dem + " --levels 0-3",
                                "explain --json " + tiles + " 3/2/5", "--help", "build --help"}) {
    const auto ran = run_tind(command + " > /dev/full");
    EXPECT_EQ(ran.code, 74) << command << ran.out;
    EXPECT_NE(ran.out.find("cannot write to standard output: No space left on device"),
              std::string::npos)
        << command << ran.out;
  }
}

TEST(Output, another_crs_beside_a_raster_without_one_is_not_taken_for_its_own) {
  const test::TempDir folder;
  const std::string without = folder.file("dem.asc"), out = folder.file("slope.asc");
  std::ofstream(without) << "ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
                            "1 2 3\n4 5 6\n7 8 9\n";
  ASSERT_EQ(run_tind("slope " + without + " --crs EPSG:32632 -o " + out).code, 0);
  const std::string prj = read_whole_file(folder.file("slope.prj")).value();
  const auto ran = run_tind("slope " + without + " -o " + out);
  EXPECT_EQ(ran.code, 2) << ran.out;
  EXPECT_NE(ran.out.find("slope.prj is there, and the DEM has no CRS"), std::string::npos);
  EXPECT_EQ(read_whole_file(folder.file("slope.prj")).value_or(""), prj);
}

TEST(Output, a_profile_over_a_void_has_its_heights_beside_it) {
  const test::TempDir folder;
  const std::string dem = folder.file("dem.asc"), out = folder.file("line.geojson");
  std::ofstream(dem) << "ncols 4\nnrows 2\nxllcenter 7\nyllcenter 0\ncellsize 1\nNODATA_value -1\n"
                        "10 20 -1 30\n10 20 -1 30\n";
  const auto ran =
      run_tind("profile " + dem + " --crs EPSG:4326 --line \"7,0.5 10,0.5\" --samples 7 -o " + out);
  ASSERT_EQ(ran.code, 0) << ran.out;
  const auto feature = nlohmann::json::parse(read_whole_file(out).value());
  const auto &line = feature["geometry"]["coordinates"],
             &heights = feature["properties"]["height_m"];
  ASSERT_EQ(line.size(), heights.size());
  for (const auto& position : line)
    EXPECT_EQ(position.size(), 2u) << "among others of three numbers it would be of height 0";
  EXPECT_NEAR(double(heights[0]), 10, 1e-3);
  EXPECT_TRUE(heights[4].is_null()) << heights;
}

TEST(Output, a_profile_is_json_where_that_is_asked_and_said_as_json_where_it_is_in_a_file) {
  const test::TempDir folder;
  const std::string dem = folder.file("dem.asc"), out = folder.file("line.csv");
  std::ofstream(dem) << "ncols 4\nnrows 2\nxllcenter 7\nyllcenter 0\ncellsize 1\nNODATA_value -1\n"
                        "10 20 -1 30\n10 20 -1 30\n";
  const std::string line =
      "profile " + dem + " --crs EPSG:4326 --line \"7,0.5 10,0.5\" --samples 4 --json";
  const auto printed = test::tind_json(line);
  EXPECT_EQ(printed["points"].size(), 4u) << printed;
  const auto said = test::tind_json(line + " -o " + out);
  EXPECT_EQ(said["places"], 4) << said;
  EXPECT_EQ(said["without_height"], 1) << said;
  EXPECT_EQ(said["length_m"], printed["length_m"]);
  EXPECT_TRUE(read_whole_file(out)->starts_with("distance_m,"));
  EXPECT_EQ(run_tind(line + " --format csv").code, 2);
}

TEST(Output, a_local_grid_in_feet_is_measured_in_metres) {
  const test::TempDir folder;
  const std::string dem = folder.file("site.asc");
  std::ofstream(dem) << "ncols 3\nnrows 3\nxllcenter 0\nyllcenter 0\ncellsize 10\n"
                        "1 2 3\n1 2 3\n1 2 3\n";
  std::ofstream(folder.file("site.prj")) << R"(LOCAL_CS["site",UNIT["foot",0.3048]])";
  EXPECT_NEAR(double(test::tind_json("info " + dem + " --json")["spacing_m"][0]), 3.048, 1e-9);
  const auto volume = test::tind_json("volume " + dem + " --height 1 --json");
  EXPECT_NEAR(double(volume["net"]["m3"]), 20 * 20 * 0.3048 * 0.3048, 1e-6) << volume;
  const std::string out = folder.file("slope.asc");
  ASSERT_EQ(run_tind("slope " + dem + " -o " + out).code, 0);
  EXPECT_NE(read_whole_file(out)->find("18.16"), std::string::npos) << "atan(1 / 3.048)";
}

TEST(Output, the_environment_changes_no_height_and_no_place) {
  const test::TempDir folder;
  const std::string dem = folder.file("dem.asc");
  std::ofstream(dem)
      << "ncols 2\nnrows 2\nxllcorner 7\nyllcorner 46\ncellsize 0.01\n1.5 2.5\n3.5 4.5\n";
  const std::string line = "elevation " + dem + " --crs EPSG:4326 --at 7.005,46.015";
  const auto plain = run_tind(line);
  ASSERT_EQ(plain.code, 0) << plain.out;
  for (const char* variable :
       {"AAIGRID_DATATYPE=Int32", "GDAL_GEOREF_SOURCES=NONE", "GDAL_SKIP=AAIGrid",
        "OSR_DEFAULT_AXIS_MAPPING_STRATEGY=AUTHORITY_COMPLIANT"}) {
    const auto ran = run_tind(line, variable);
    EXPECT_EQ(ran.code, 0) << variable << ran.out;
    EXPECT_EQ(ran.answer, plain.answer) << variable;
  }
}

TEST(Output, a_header_beside_makes_no_raw_numbers_of_any_file) {
  const test::TempDir folder;
  const std::string dem = folder.file("v.flt"), text = folder.file("v.xyz");
  const float posts[] = {1, 2, 3, 4};
  std::ofstream(dem, std::ios::binary).write(reinterpret_cast<const char*>(posts), sizeof posts);
  std::ofstream(folder.file("v.hdr")) << "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
                                         "NODATA_value -9999\nbyteorder LSBFIRST\n";
  std::ofstream(text) << "0.5 1.5 1\n1.5 1.5 2\n0.5 0.5 3\n1.5 0.5 4\n";
  EXPECT_EQ(run_tind("info " + dem).code, 0);
  const auto refused = run_tind("info " + text);
  EXPECT_EQ(refused.code, 65) << refused.out;
  EXPECT_NE(refused.out.find("not a raster tind reads"), std::string::npos) << refused.out;
}

TEST(Output, a_profile_over_the_antimeridian_is_cut_there) {
  const test::TempDir folder;
  const std::string dem = folder.file("dem.asc"), out = folder.file("line.geojson");
  std::ofstream(dem) << "ncols 3\nnrows 2\nxllcenter 179\nyllcenter 0\ncellsize 1\n"
                        "10 20 30\n10 20 30\n";
  const auto ran =
      run_tind("profile " + dem + " --crs EPSG:4326 --line \"179.25,0.5 -179.25,0.5\" -o " + out);
  ASSERT_EQ(ran.code, 0) << ran.out;
  const auto line = nlohmann::json::parse(read_whole_file(out).value())["geometry"];
  ASSERT_EQ(line["type"], "MultiLineString");
  ASSERT_EQ(line["coordinates"].size(), 2u);
  const auto west = line["coordinates"][0].back(), east = line["coordinates"][1].front();
  EXPECT_EQ(west[0], 180);
  EXPECT_EQ(east[0], -180);
  EXPECT_EQ(west[1], east[1]);
  EXPECT_NEAR(west[2], 20, 1e-3);
  for (const auto& part : line["coordinates"])
    for (std::size_t i = 1; i < part.size(); ++i)
      EXPECT_LT(std::abs(double(part[i][0]) - double(part[i - 1][0])), 2);
}

TEST(Output, a_raster_whose_crs_no_raster_can_say_is_refused) {
  const test::TempDir folder;
  std::ofstream(folder.file("a.asc")) << "ncols 3\nnrows 3\nxllcorner 1\nyllcorner 1\n"
                                         "cellsize 0.01\n1 2 3\n4 5 6\n7 8 9\n";
  const std::string turned =
      "slope " + folder.file("a.asc") +
      " --crs '+proj=ob_tran +o_proj=longlat +o_lat_p=39.25 +o_lon_p=0 +lon_0=18 +R=6371229' -o ";
  for (const char* name : {"s.tif", "s.asc"}) {
    const auto ran = run_tind(turned + folder.file(name));
    EXPECT_EQ(ran.code, 65);
    EXPECT_NE(ran.out.find("pole is turned"), std::string::npos) << ran.out;
    EXPECT_FALSE(std::filesystem::exists(folder.file(name)));
  }
}

TEST(Output, numbers_that_no_ground_has_are_refused) {
  const std::string dem = test::testdata("rainier.tif") + " ";
  for (const std::string& line : std::vector<std::string>{
           "volume " + dem + "--height 1e308",
           "volume " + dem + "--plane '-121.8,46.8,1e300 -121.7,46.8,1 -121.8,46.9,1'",
           "viewshed " + dem + "--from -121.75,46.85 --uncertainty 1e8 -o /dev/null"}) {
    const auto ran = run_tind(line);
    EXPECT_EQ(ran.code, 2) << line << ran.out;
  }
}

TEST(Output, files_that_belong_together_come_one_after_the_other) {
  const test::TempDir folder;
  auto first = cli::OutputTurn::take(folder.file("a.raw"));
  ASSERT_TRUE(first);
  std::atomic<bool> taken = false;
  std::jthread other([&] {
    const auto second = cli::OutputTurn::take(folder.file("b.raw"));
    EXPECT_TRUE(second);
    taken = true;
  });
  EXPECT_TRUE(cli::OutputTurn::take(test::testdata("x.raw"))) << "of another folder";
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_FALSE(taken);
  first = fail(Errc::cancelled, "");  // lets it go
  other.join();
  EXPECT_TRUE(taken);
}

TEST(Output, options_that_would_do_nothing_are_refused) {
  const test::TempDir folder;
  const std::string dem = test::testdata("rainier.tif"), polygons = folder.file("a.geojson");
  const std::string mesh = folder.file("mesh.ply"), none = folder.file("none");
  ASSERT_EQ(run_tind("simplify " + dem + " --ratio 0.01 -o " + mesh).code, 0);
  std::ofstream(polygons) << R"({"type": "Polygon", "coordinates":
      [[[-121.8, 46.8], [-121.7, 46.8], [-121.7, 46.9], [-121.8, 46.8]]]})";
  for (const std::string& command :
       {"statistics " + dem + " --polygons " + polygons + " --json -o " + none + ".csv",
        "measure " + mesh + " " + mesh + " --units source",
        "measure " + mesh + " " + mesh + " --frame metric",
        "contours " + dem + " --levels 1000 --base 7 -o " + none + ".geojson",
        "relief " + dem + " --low 6000 -o " + none + ".png",
        "relief " + dem + " --high -10 -o " + none + ".png",
        "volume " + test::testdata("crater.tif") + " --plane \"9,45,1 9.1,45,1 9,45.1,10\""}) {
    const auto ran = run_tind(command);
    EXPECT_EQ(ran.code, 2) << command << ran.out;
  }
  for (const char* ending : {".csv", ".geojson", ".png"})
    EXPECT_FALSE(std::filesystem::exists(none + ending)) << ending;
}

TEST(Output, what_goes_to_standard_output_has_it_alone) {
  const test::TempDir folder;
  const std::string simplify = "simplify " + test::testdata("desert.asc") + " --ratio 0.01";
  ASSERT_EQ(run_tind(simplify + " -o " + folder.file("mesh.ply")).code, 0);
  const std::string mesh = read_whole_file(folder.file("mesh.ply")).value();
  for (const std::string output : {"-o -", "--output -", "--output=-", "-o /dev/stdout"}) {
    const auto ran = run_tind(simplify + " --format ply --json " + output);
    EXPECT_EQ(ran.code, 0) << ran.out;
    EXPECT_TRUE(ran.answer == mesh) << output;
    EXPECT_NE(ran.out.find("\"max_error_m\""), std::string::npos) << output;  // on stderr
  }
  const std::string log = folder.file("log");
  ASSERT_TRUE(write_whole_file(log, "begins"));
  ASSERT_EQ(run_tind(simplify + " --format ply -o - >> " + log).code, 0);
  EXPECT_TRUE(read_whole_file(log).value() == "begins" + mesh);
}

/// The limit that a shell or a scheduler sets would end the program by a signal, without a word.
TEST(Output, a_limit_on_the_size_of_files_is_an_error) {
  const test::TempDir folder;
  const std::string mesh = folder.file("mesh.ply");
  const auto ran = run_tind("simplify " + test::testdata("rainier.tif") + " --ratio 0.2 -o " + mesh,
                            "ulimit -f 16;");
  EXPECT_EQ(ran.code, 74) << ran.out;
  EXPECT_NE(ran.out.find("File too large"), std::string::npos) << ran.out;
  EXPECT_FALSE(read_whole_file(mesh));
}

}  // namespace
}  // namespace tind
