#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "proto/mesh/mesh_io.h"
#include "terrain/base/file_io.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/mesh/mesh_frame.h"
#include "tests/support/program.h"
#include "tests/support/support.h"
#include "tests/terrain/progressive/shapes.h"

namespace tind {
namespace {

TEST(Progressive, AStreamIsMadeAndLevelsComeOutWithinTheirError) {
  const test::TempDir dir;
  const std::string tpm = dir.file("crater.tpm"), ply = dir.file("out.ply");
  const auto made = test::run_tind(std::string("progressive ") + test::testdata("crater.tif") +
                                   " -o " + tpm + " --method qem --max-error 4 --json");
  ASSERT_EQ(made.code, 0) << made.out;
  const auto figures = nlohmann::json::parse(made.answer);
  EXPECT_LE(figures["fine_error_m"], 4.25);
  for (const char* error : {"100", "20", "5"}) {
    const auto got = test::run_tind(std::string("extract ") + tpm + " --max-error " + error +
                                    " -o " + ply + " --json");
    ASSERT_EQ(got.code, 0) << got.out;
    const auto level = nlohmann::json::parse(got.answer);
    const auto measured = test::run_tind(std::string("measure ") + ply + " " +
                                         test::testdata("crater.tif") + " --json");
    ASSERT_EQ(measured.code, 0) << measured.out;
    const auto truth = nlohmann::json::parse(measured.answer);
    EXPECT_LE(truth["max_error_m"], level["max_error_m"].get<double>() + 1e-6);
    EXPECT_LE(level["max_error_m"], std::stod(error));
    EXPECT_EQ(truth["posts_uncovered"], 0);
    EXPECT_EQ(truth["flipped"], 0);
  }
  const auto few =
      test::run_tind(std::string("extract ") + tpm + " --triangles 500 -o " + ply + " --json");
  ASSERT_EQ(few.code, 0) << few.out;
  EXPECT_NEAR(nlohmann::json::parse(few.answer)["triangles"].get<double>(), 500, 1);

  const auto too_few = test::run_tind("extract " + tpm + " --triangles 1 -o " + ply);
  EXPECT_EQ(too_few.code, 2);
  EXPECT_NE(too_few.out.find("triangles at its coarsest, not 1"), std::string::npos) << too_few.out;
  const auto least = figures["base_triangles"].get<int>();
  const auto base = test::run_tind("extract " + tpm + " -o " + ply + " --json --triangles " +
                                   std::to_string(least));
  ASSERT_EQ(base.code, 0) << base.out;
  EXPECT_EQ(nlohmann::json::parse(base.answer)["triangles"], least);

  const auto stl = test::run_tind("extract " + tpm + " -o " + dir.file("a.stl") + " --json");
  ASSERT_EQ(stl.code, 0) << stl.out;
  EXPECT_TRUE(nlohmann::json::parse(stl.answer).contains("rounding"));  // 32-bit coordinates
  const auto finest = test::run_tind("extract " + tpm + " -o " + ply + " --json");
  ASSERT_EQ(finest.code, 0) << finest.out;
  EXPECT_EQ(nlohmann::json::parse(finest.answer)["splits"], figures["splits"]);
  EXPECT_FALSE(nlohmann::json::parse(finest.answer).contains("rounding"));
  EXPECT_EQ(nlohmann::json::parse(finest.answer)["max_error_m"], figures["fine_error_m"]);

  const auto whole = read_whole_file(tpm);
  ASSERT_TRUE(write_whole_file(dir.file("cut.tpm"), whole->substr(0, whole->size() / 2)));
  const auto cut = test::run_tind(std::string("extract ") + dir.file("cut.tpm") +
                                  " --triangles 100000000 -o " + ply + " --json");
  ASSERT_EQ(cut.code, 0) << cut.out;
  EXPECT_EQ(nlohmann::json::parse(cut.answer)["complete"], false);
  const auto too_fine =
      test::run_tind(std::string("extract ") + tpm + " --max-error 0.5 -o " + ply);
  EXPECT_NE(too_fine.code, 0);
  EXPECT_NE(too_fine.out.find("finest"), std::string::npos) << too_fine.out;
}

TEST(Progressive, AnErrorBelowTheRoundingOfHeightsIsStatedAsItIs) {
  const test::TempDir dir;
  std::ofstream dem(dir.file("a.asc"));  // heights that floats round by up to half a millimetre
  dem << "ncols 9\nnrows 9\nxllcenter 500000\nyllcenter 5000000\ncellsize 1\n";
  for (int i = 0; i < 81; ++i) dem << i * i % 97 << (i % 9 < 8 ? ' ' : '\n');
  dem.close();
  const auto made = test::run_tind("progressive " + dir.file("a.asc") +
                                   " --scale 0.0003 --offset 9000 --max-error 0.0002 --json -o " +
                                   dir.file("a.tpm"));
  ASSERT_EQ(made.code, 0) << made.out;
  EXPECT_GT(nlohmann::json::parse(made.answer)["fine_error_m"], 0.0004);
}

TEST(Progressive, OfAMeshTakesNoOptionOfDems) {
  const test::TempDir dir;
  const std::string mesh = dir.file("a.ply"), tpm = dir.file("a.tpm");
  ASSERT_EQ(
      test::run_tind("simplify " + test::testdata("crater.tif") + " --max-error 20 -o " + mesh)
          .code,
      0);
  const std::string line = "progressive " + mesh + " -o " + tpm + " --method qem";
  EXPECT_EQ(test::run_tind(line).code, 0);
  for (const char* option : {" --nodata 5", " --crs EPSG:25832", " --band 7", " --from-datum egm96",
                             " --bounds 0,0,1,1", " --subset-placement", " --border-constraints"})
    EXPECT_EQ(test::run_tind(line + option).code, 2) << option;
}

TEST(Progressive, WhatItPrintsIsABoundThatOneCanAskFor) {
  const test::TempDir dir;
  const std::string tpm = dir.file("a.tpm");
  ASSERT_EQ(test::run_tind("progressive " + test::testdata("crater.tif") +
                           " --max-error 0.77777 -o " + tpm)
                .code,
            0);
  const std::string extract = "extract " + tpm + " -o " + dir.file("a.ply");
  const auto finest = test::run_tind(extract).out;
  const std::string before = "every post within ";
  const auto at = finest.find(before);
  ASSERT_NE(at, std::string::npos) << finest;
  const std::string bound =
      finest.substr(at + before.size(), finest.find(' ', at + before.size()) - at - before.size());
  EXPECT_EQ(test::run_tind(extract + " --max-error " + bound).code, 0) << bound;
}

TEST(Progressive, SaysWhatOpenVoidsLeaveOut) {
  const test::TempDir dir;
  const std::string dem = dir.file("dem.asc");
  std::ofstream(dem) << "ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 10\n"
                        "NODATA_value -9999\n1 2 -9999 5\n3 4 -9999 -9999\n-9999 -9999 -9999 7\n";
  for (const std::string method : {"bounded", "qem"}) {
    const auto made = test::run_tind("progressive " + dem + " -o " + dir.file("a.tpm") +
                                     " --json --method " + method);
    ASSERT_EQ(made.code, 0) << made.out;
    EXPECT_EQ(nlohmann::json::parse(made.answer)["posts_isolated"], 2);
  }
  const auto told = test::run_tind("progressive " + dem + " -o " + dir.file("a.tpm"));
  EXPECT_NE(told.out.find("2 valid posts have no cell"), std::string::npos) << told.out;
}

TEST(Progressive, AStepNeverTakesItBeyondTheError) {
  const test::TempDir dir;
  const std::string start = std::string("progressive ") + test::testdata("crater.tif") + " -o " +
                            dir.file("a.tpm") + " --json --max-error 2 --step ";
  for (const char* step : {"0.25", "1", "3.5"}) {
    const auto made = test::run_tind(start + step);
    ASSERT_EQ(made.code, 0) << made.out;
    EXPECT_LE(nlohmann::json::parse(made.answer)["fine_error_m"].get<double>(), 2) << step;
  }
  const auto refused = test::run_tind(start + "4");
  EXPECT_EQ(refused.code, 2) << refused.out;
  EXPECT_NE(refused.out.find("--max-error"), std::string::npos) << refused.out;
}

TEST(Progressive, AMeshIsTakenToo) {
  const test::TempDir dir;
  const std::string tpm = dir.file("ball.tpm"), fine = dir.file("ball.ply"),
                    ply = dir.file("out.ply");
  ASSERT_TRUE(write_mesh(fine, to_file_mesh(test::sphere(400))));
  const auto made = test::run_tind("progressive " + fine + " -o " + tpm + " --json");
  ASSERT_EQ(made.code, 0) << made.out;
  const auto figures = nlohmann::json::parse(made.answer);
  EXPECT_EQ(figures["method"], "qem");
  EXPECT_EQ(figures["vertices"], 414);
  for (const char* error : {"0.5", "0.1"}) {
    const auto got =
        test::run_tind("extract " + tpm + " --max-error " + error + " -o " + ply + " --json");
    ASSERT_EQ(got.code, 0) << got.out;
    const auto level = nlohmann::json::parse(got.answer);
    EXPECT_LE(level.at("max_error"), std::stod(error));
    const auto measured = test::run_tind("measure " + ply + " " + fine + " --json");
    ASSERT_EQ(measured.code, 0) << measured.out;
    EXPECT_LE(nlohmann::json::parse(measured.answer).at("distance_max"), level.at("max_error"));
  }
  for (const char* options :
       {" --max-error 1", " --lattice 4", " --step 0", " --step 1e-12", " --method bounded"}) {
    const auto refused = test::run_tind("progressive " + fine + " -o " + tpm + options);
    EXPECT_EQ(refused.code, 2) << options << ": " << refused.out;
  }
}

TEST(Progressive, SaysWhatIsWrong) {
  const test::TempDir dir;
  const auto greedy = test::run_tind(std::string("progressive ") + test::testdata("crater.tif") +
                                     " -o " + dir.file("a.tpm") + " --method greedy");
  EXPECT_NE(greedy.code, 0);
  EXPECT_NE(greedy.out.find("collapse"), std::string::npos) << greedy.out;
  const auto no_stream = test::run_tind(std::string("extract ") + test::testdata("crater.tif") +
                                        " --triangles 9 -o " + dir.file("a.ply"));
  EXPECT_EQ(no_stream.code, 65) << no_stream.out;
}

}  // namespace
}  // namespace tind
