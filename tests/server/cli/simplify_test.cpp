// The program itself: `tind simplify`, then `tind measure` of what it wrote.

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "proto/mesh_io.h"
#include "tests/support/program_json.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::Ran;
using test::run_tind;
using test::TempDir;
using test::testdata;
using test::tind_json;

class SimplifyCommand : public testing::TestWithParam<const char*> {};

TEST_P(SimplifyCommand, ReportsWhatMeasureFindsInTheFile) {
  const TempDir dir;
  const std::string mesh = dir.file(std::string("out.") + GetParam()), dem = testdata("crater.tif");
  for (const std::string frame : {"source", "metric"}) {
    const nlohmann::json made = tind_json("simplify " + dem + " -o " + mesh +
                                          " --method qem --triangles 5000 --json --frame " + frame +
                                          " --report " + dir.file("report.json"));
    for (const char* key : {"method", "steps", "input_triangles", "triangles", "vertices",
                            "max_error_m", "rms_error_m", "mean_error_m", "p50_m", "p95_m", "p99_m",
                            "flipped", "uncovered", "frame", "seconds"})
      EXPECT_TRUE(made.contains(key)) << key;
    for (const char* key : {"read", "simplify", "measure", "write"})
      EXPECT_TRUE(made["seconds"].contains(key)) << key;
    std::ifstream report(dir.file("report.json"));
    EXPECT_EQ(nlohmann::json::parse(report), made);
    EXPECT_EQ(made["flipped"], 0);
    EXPECT_EQ(made["uncovered"], 0);
    EXPECT_GE(made["triangles"], 5000);
    EXPECT_LE(made["triangles"], 5001);

    const nlohmann::json found =
        tind_json("measure " + mesh + " " + dem + " --json --frame " + frame);
    EXPECT_EQ(found["triangles"], made["triangles"]);
    EXPECT_EQ(found["posts"], made["posts"]);
    EXPECT_EQ(found["flipped"], 0);
    EXPECT_EQ(found["uncovered"], 0);
    EXPECT_NEAR(found["max_error_m"], made["max_error_m"], 1e-6);
    EXPECT_NEAR(found["rms_error_m"], made["rms_error_m"], 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, SimplifyCommand, testing::Values("ply", "obj", "stl"));

TEST(SimplifyCommandLine, KeepsTheBoundOfTheMeshAsWritten) {
  const TempDir dir;
  const nlohmann::json made = tind_json("simplify " + testdata("bigtujunga_crop.tif") + " -o " +
                                        dir.file("a.ply") + " --max-error 7.5 --json");
  EXPECT_LE(made["max_error_m"], 7.5);
  EXPECT_LT(made["triangles"], made["input_triangles"]);
}

TEST(SimplifyCommandLine, PutsTheMeshWhereTheDemIs) {
  const TempDir dir;
  std::ofstream(dir.file("dem.asc")) << "ncols 3\nnrows 2\nxllcorner 100\nyllcorner 200\ncellsize "
                                        "10\n1 2 3\n4 5 6\n";
  tind_json("simplify " + dir.file("dem.asc") + " -o " + dir.file("a.obj") + " --ratio 1 --json");
  const auto mesh = proto::read_mesh(dir.file("a.obj"));
  ASSERT_TRUE(mesh) << mesh.error();
  EXPECT_EQ(mesh->positions.front(), (std::array<double, 3>{105, 215, 1}));
  EXPECT_EQ(mesh->positions.back(), (std::array<double, 3>{125, 205, 6}));
}

TEST(SimplifyCommandLine, ClusterTakesASourceLargerThanItsMemory) {
  const TempDir dir;
  const std::int64_t cols = 32768, rows = 3072;  // 400 MB as floats
  std::ofstream(dir.file("large.vrt"))
      << "<VRTDataset rasterXSize=\"" << cols << "\" rasterYSize=\"" << rows
      << "\"><VRTRasterBand dataType=\"Float32\" band=\"1\" blockXSize=\"256\" "
         "blockYSize=\"256\"><SimpleSource><SourceFilename>"
      << std::filesystem::absolute(testdata("bigtujunga_crop.tif")).string()
      << "</SourceFilename><SourceBand>1</SourceBand><DstRect xOff=\"0\" yOff=\"0\" xSize=\""
      << cols << "\" ySize=\"" << rows << "\"/></SimpleSource></VRTRasterBand></VRTDataset>\n";
  const std::string command = "simplify " + dir.file("large.vrt") + " --allow-vrt -o " +
                              dir.file("a.ply") + " --method cluster";
  const nlohmann::json made = tind_json(command + " --triangles 20000 --json --progress none");
  if (!test::kSanitized) {
    EXPECT_LT(made["peak_mb"], 0.7 * double(cols * rows) * sizeof(float) / (1 << 20));
  }
  EXPECT_EQ(made["posts"], cols * rows);
  EXPECT_EQ(made["flipped"], 0);
  EXPECT_EQ(made["uncovered"], 0);
  EXPECT_LE(made["triangles"], 20000);
  EXPECT_GT(made["triangles"], 19000);
  const Ran bound = run_tind(command + " --max-error 5");
  EXPECT_EQ(bound.code, 65) << bound.out;
  EXPECT_NE(bound.out.find("--triangles"), std::string::npos) << bound.out;
}

TEST(SimplifyCommandLine, RefusesInOneLineWithAnHonestCode) {
  const TempDir dir;
  const std::string dem = testdata("crater.tif"), out = " -o " + dir.file("a.ply");
  const auto refuses = [](const std::string& arguments, int code) {
    const Ran ran = run_tind("simplify " + arguments);
    EXPECT_EQ(ran.code, code) << ran.out;
    EXPECT_FALSE(ran.out.empty());
    return ran.out;
  };
  refuses(dem + out, 2);
  refuses(dem + out + " --ratio 0.5 --triangles 9", 2);
  refuses(dem + out + " --ratio 1.5", 2);
  refuses(dem + out + " --ratio 0.5 --method magic", 2);
  refuses(dem + out + " --ratio 0.5 --term colour", 2);
  refuses(dem + " --ratio 0.5 -o " + dir.file("a.xyz"), 2);
  refuses(dir.file("missing.tif") + out + " --ratio 0.5", 69);
  refuses(dem + " --ratio 0.5 -o " + dir.file("no/such/folder/a.ply"), 73);
  std::ofstream(dir.file("text.tif")) << "not a raster";
  refuses(dir.file("text.tif") + out + " --ratio 0.5", 65);
  std::ofstream(dir.file("row.asc")) << "ncols 5\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
                                        "1 2 3 4 5\n";
  const std::string said = refuses(dir.file("row.asc") + out + " --ratio 0.5", 2);
  EXPECT_NE(said.find("2 x 2"), std::string::npos) << said;
  EXPECT_FALSE(std::filesystem::exists(dir.file("a.ply")));
}

TEST(MeasureCommandLine, SaysWhenMeshAndDemDoNotMeet) {
  const TempDir dir;
  std::ofstream(dir.file("far.obj")) << "v 1e7 1e7 0\nv 1e7 2e7 0\nv 2e7 1e7 0\nf 1 3 2\n";
  const Ran ran = run_tind("measure " + dir.file("far.obj") + " " + testdata("crater.tif"));
  EXPECT_EQ(ran.code, 65);
  EXPECT_NE(ran.out.find("covers no post"), std::string::npos) << ran.out;
}

TEST(MethodsCommandLine, ListsEveryMethod) {
  const nlohmann::json all = tind_json("methods --json");
  std::vector<std::string> names;
  for (const auto& m : all) {
    names.push_back(m["name"]);
    for (const char* key : {"minimises", "stops", "guarantees", "source"})
      EXPECT_FALSE(m[key].get<std::string>().empty()) << names.back() << " " << key;
  }
  for (const char* name : {"edge-cost", "qem", "memoryless"})
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
}

}  // namespace
}  // namespace tind
