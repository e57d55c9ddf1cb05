// The program itself: `tind simplify`, then `tind measure` of what it wrote.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "proto/mesh/mesh_io.h"
#include "terrain/base/file_io.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/simplify/methods.h"
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
                            "flipped", "posts_uncovered", "frame", "seconds"})
      EXPECT_TRUE(made.contains(key)) << key;
    for (const char* key : {"read", "simplify", "measure", "write"})
      EXPECT_TRUE(made["seconds"].contains(key)) << key;
    std::ifstream report(dir.file("report.json"));
    EXPECT_EQ(nlohmann::json::parse(report), made);
    EXPECT_EQ(made["flipped"], 0);
    EXPECT_EQ(made["posts_uncovered"], 0);
    EXPECT_GE(made["triangles"], 4999);
    EXPECT_LE(made["triangles"], 5000);

    const nlohmann::json found =
        tind_json("measure " + mesh + " " + dem + " --json --frame " + frame);
    EXPECT_EQ(found["triangles"], made["triangles"]);
    EXPECT_EQ(found["posts"], made["posts"]);
    EXPECT_EQ(found["flipped"], 0);
    EXPECT_EQ(found["posts_uncovered"], 0);
    EXPECT_NEAR(found["max_error_m"], made["max_error_m"], 1e-6);
    EXPECT_NEAR(found["rms_error_m"], made["rms_error_m"], 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, SimplifyCommand,
                         testing::Values("ply", "obj", "stl", "2dm", "xml"));

TEST(SimplifyCommandLine, KeepsTheBoundOfTheMeshAsWritten) {
  const TempDir dir;
  const nlohmann::json made = tind_json("simplify " + testdata("bigtujunga_crop.tif") + " -o " +
                                        dir.file("a.ply") + " --max-error 7.5 --json");
  EXPECT_LE(made["max_error_m"], 7.5);
  EXPECT_LT(made["triangles"], made["input_triangles"]);
}

/// 40 x 40 posts, `step` apart.
void write_fine(const std::string& path, const std::string& corner, const std::string& step) {
  std::ofstream file(path);
  file << "ncols 40\nnrows 40\n" << corner << "\ncellsize " << step << "\n";
  for (int r = 0; r < 40; ++r)
    for (int c = 0; c < 40; ++c) file << (r * c % 7) * 0.001 << (c < 39 ? ' ' : '\n');
}

TEST(SimplifyCommandLine, CoversPostsThatLieNoFurtherApartThanCoordinatesRound) {
  const TempDir dir;
  const std::string dem = dir.file("dem.asc"), mesh = dir.file("a.ply");
  for (const auto& [corner, step] :
       std::map<std::string, std::string>{{"xllcorner 431234.567\nyllcorner 5212345.678", "0.01"},
                                          {"xllcorner 179.6\nyllcorner 66.1", "0.00000001"}}) {
    write_fine(dem, corner, step);
    const nlohmann::json made =
        tind_json("simplify " + dem + " --max-error 0.003 -o " + mesh + " --json");
    EXPECT_EQ(made["posts_uncovered"], 0) << corner;
    EXPECT_EQ(made["posts"], 1600) << corner;
    EXPECT_LE(made["max_error_m"], 0.003 + 1e-8) << corner;
    EXPECT_EQ(tind_json("measure " + mesh + " " + dem + " --json")["posts_uncovered"], 0);
  }
}

TEST(SimplifyCommandLine, StatesTheErrorOverTheSourcesHeightsNotOverThoseInMemory) {
  const TempDir dir;
  const std::string dem = dir.file("dem.asc"), mesh = dir.file("a.ply");
  std::vector<double> heights;  // which floats hold within half a millimetre
  std::ofstream file(dem);
  file << "ncols 40\nnrows 40\nxllcenter 500000\nyllcenter 5000000\ncellsize 10\n";
  for (int r = 0; r < 40; ++r)
    for (int c = 0; c < 40; ++c) {
      const int n = (r * 37 + c * c * 11) % 1000 + 90 * c;
      heights.push_back(n * 0.0003 + 9000);
      file << n << (c < 39 ? ' ' : '\n');
    }
  file.close();
  const std::string line = "simplify " + dem + " --scale 0.0003 --offset 9000 -o " + mesh;
  const auto seen = [&](double& below) {  // with planes over all posts
    const auto made = read_mesh(mesh);
    EXPECT_TRUE(made);
    double worst = 0;
    below = 0;
    for (int r = 0; r < 40; ++r)
      for (int c = 0; c < 40; ++c) {
        const double x = 500000 + 10 * c, y = 5000000 + 10 * (39 - r);
        for (const auto& t : made->triangles) {
          const auto &p = made->positions[t[0]], &q = made->positions[t[1]],
                     &s = made->positions[t[2]];
          const double all = (q[0] - p[0]) * (s[1] - p[1]) - (s[0] - p[0]) * (q[1] - p[1]);
          const double u = ((x - p[0]) * (s[1] - p[1]) - (s[0] - p[0]) * (y - p[1])) / all,
                       v = ((q[0] - p[0]) * (y - p[1]) - (x - p[0]) * (q[1] - p[1])) / all;
          if (u < -1e-12 || v < -1e-12 || u + v > 1 + 1e-12) continue;
          const double off =
              p[2] + u * (q[2] - p[2]) + v * (s[2] - p[2]) - heights[std::size_t(40 * r + c)];
          worst = std::max(worst, std::abs(off)), below = std::max(below, -off);
        }
      }
    return worst;
  };
  double below = 0;
  const nlohmann::json all = tind_json(line + " --method qem --ratio 1 --json");
  EXPECT_GT(seen(below), 1e-4);
  EXPECT_LE(seen(below), all["max_error_m"]);
  const nlohmann::json bounded = tind_json(line + " --max-error 0.01 --json");
  EXPECT_LE(seen(below), bounded["max_error_m"].get<double>() + 1e-9);
  EXPECT_LE(bounded["max_error_m"], 0.01 + 1e-9);
  const nlohmann::json above = tind_json(line + " --max-error 0.01 --side above --json");
  EXPECT_LE(seen(below), above["max_error_m"].get<double>() + 1e-9);
  EXPECT_LE(above["max_error_m"], 0.01 + 1e-9);
  EXPECT_EQ(above["max_below_m"], 0);
  EXPECT_LE(below, 1e-9) << "of every post";
  const nlohmann::json measured =
      tind_json("measure " + mesh + " " + dem + " --scale 0.0003 --offset 9000 --json");
  EXPECT_EQ(measured["max_below_m"], 0);
  EXPECT_NEAR(measured["max_error_m"].get<double>(), above["max_error_m"].get<double>(), 1e-9);
  const nlohmann::json too_little = tind_json(line + " --max-error 0.0001 --json");
  EXPECT_NE(too_little["note"].get<std::string>().find("rounded"), std::string::npos);
}

TEST(SimplifyCommandLine, SaysWhatStlLoses) {
  const TempDir dir;
  const std::string dem = dir.file("dem.asc");
  write_fine(dem, "xllcorner 7.6\nyllcorner 46.1", "0.000001");
  const std::string line = "simplify " + dem + " --max-error 0.003 --json -o " + dir.file("a.stl");
  const nlohmann::json lost = tind_json(line);
  EXPECT_GT(lost["posts_uncovered"], 0);
  EXPECT_NE(lost["note"].get<std::string>().find("--frame metric"), std::string::npos);
  const nlohmann::json held = tind_json(line + " --frame metric");
  EXPECT_EQ(held["posts_uncovered"], 0);
  EXPECT_EQ(held["note"], "");
}

TEST(SimplifyCommandLine, SaysFromWhereStlCountsAndThatDegreesAreNoLengths) {
  const TempDir dir;
  const auto made = [&](const char* dem, const std::string& more) {
    return run_tind("simplify " + testdata(dem) + " --max-error 60 -o " + dir.file("a.") + more);
  };
  const nlohmann::json moved = tind_json("simplify " + testdata("bigtujunga_crop.tif") +
                                         " --max-error 60 --json -o " + dir.file("a.stl"));
  const auto file = read_whole_file(dir.file("a.stl"));
  ASSERT_TRUE(file);
  const std::vector<double> at = moved["file_origin"];
  ASSERT_EQ(at.size(), 3u);
  const std::string origin = std::to_string(int(at[0])) + " " + std::to_string(int(at[1])) + " 0";
  EXPECT_TRUE(file->starts_with("tind origin " + origin)) << file->substr(0, 80);
  const auto text = made("bigtujunga_crop.tif", "stl").out;
  EXPECT_NE(text.find("counts from " + origin), std::string::npos) << text;
  EXPECT_EQ(text.find("degrees"), std::string::npos) << text;
  EXPECT_NE(made("rainier.tif", "obj").out.find("x and y are degrees"), std::string::npos);
  for (const char* fine : {"ply", "gpkg", "obj --frame metric"})
    EXPECT_EQ(made("rainier.tif", fine).out.find("x and y are degrees"), std::string::npos) << fine;
}

TEST(SimplifyCommandLine, PutsTheMeshWhereTheDemIs) {
  const TempDir dir;
  std::ofstream(dir.file("dem.asc")) << "ncols 3\nnrows 2\nxllcorner 100\nyllcorner 200\ncellsize "
                                        "10\n1 2 3\n4 5 6\n";
  tind_json("simplify " + dir.file("dem.asc") + " -o " + dir.file("a.obj") +
            " --ratio 1 --method qem --json");
  const auto mesh = read_mesh(dir.file("a.obj"));
  ASSERT_TRUE(mesh) << mesh.error().what;
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
  EXPECT_EQ(made["posts_uncovered"], 0);
  EXPECT_LE(made["triangles"], 20000);
  EXPECT_GT(made["triangles"], 19000);
  const Ran bound = run_tind(command + " --max-error 5");
  EXPECT_EQ(bound.code, 65) << bound.out;
  EXPECT_NE(bound.out.find("--triangles"), std::string::npos) << bound.out;
}

/// The option that each method reads, and a value for it.
std::string with_value(const std::string& option) {
  const std::map<std::string, std::string> values = {{"effort", "fast"},
                                                     {"side", "above"},
                                                     {"attributes", "normal"},
                                                     {"alpha", "1"},
                                                     {"beta", "1"},
                                                     {"term", "length"},
                                                     {"criterion", "degree"},
                                                     {"k", "3"},
                                                     {"drape", "a.png"},
                                                     {"placement", "centroid"},
                                                     {"attribute-metric", "joint"},
                                                     {"attribute-weight", "2"}};
  const auto value = values.find(option);
  return " --" + option + (value == values.end() ? "" : " " + value->second);
}

TEST(SimplifyCommandLine, AnOptionOfAnotherMethodIsAnErrorThatNamesBoth) {
  const TempDir dir;
  std::ofstream(dir.file("dem.asc")) << "ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 10\n"
                                        "1 2 3 4 5 6 7 8 9\n";
  const std::string start =
      "simplify " + dir.file("dem.asc") + " --ratio 0.9 -o " + dir.file("a.ply") + " --method ";
  for (const MethodInfo& owner : methods()) {
    for (const std::string& option : owner.options) {
      for (const MethodInfo& other : methods()) {
        if (option == "drape" && other.name == owner.name) continue;  // there is no such picture
        // Of a name that two methods have, each reads its own words.
        const bool edge = option == "placement" && other.name == EdgeCostOptions::kName;
        const Ran ran =
            run_tind(start + other.name + (edge ? " --placement fit" : with_value(option)));
        const bool reads = std::ranges::count(other.options, option) > 0;
        ASSERT_EQ(ran.code, reads ? 0 : 2) << other.name << " --" << option << "\n" << ran.out;
        if (reads) continue;
        EXPECT_NE(ran.out.find("--" + option), std::string::npos) << ran.out;
        EXPECT_NE(ran.out.find(other.name), std::string::npos) << ran.out;
        EXPECT_NE(ran.out.find(owner.name), std::string::npos) << ran.out;
      }
    }
  }
}

TEST(SimplifyCommandLine, TakesTheBestMethodWhereNoneIsNamed) {
  const TempDir dir;
  const std::string ply = dir.file("a.ply"), start = "simplify " + testdata("crater.tif") + " -o ";
  EXPECT_EQ(tind_json(start + ply + " --max-error 20 --json")["method"], "bounded");
  EXPECT_EQ(tind_json(start + ply + " --triangles 900 --json")["method"], "bounded");
  EXPECT_EQ(
      tind_json("simplify " + ply + " -o " + dir.file("b.ply") + " --ratio 0.5 --json")["method"],
      "qem");
}

TEST(SimplifyCommandLine, NamesThePostsThatNoTriangleCovers) {
  const TempDir dir;
  std::ofstream(dir.file("dem.asc")) << "ncols 5\nnrows 4\nxllcorner 0\nyllcorner 0\ncellsize 10\n"
                                        "nodata_value -9\n"
                                        "1 2 3 -9 5  1 2 3 -9 -9  1 2 3 -9 7  1 2 3 -9 8\n";
  const std::string start = "simplify " + dir.file("dem.asc") + " --ratio 1 -o " +
                            dir.file("a.ply") + " --json --method ";
  for (const MethodInfo& m : methods())
    for (const bool keep : {false, true}) {
      const nlohmann::json made = tind_json(start + m.name + (keep ? " --voids keep" : ""));
      EXPECT_EQ(made["posts_uncovered"], keep ? 3 : 0) << m.name;
      EXPECT_EQ(made["posts_isolated"], keep ? 3 : 0) << m.name;
      EXPECT_EQ(made["posts"], keep ? 12 : 15) << m.name;
    }
  const Ran ran = run_tind("simplify " + dir.file("dem.asc") +
                           " --ratio 1 --method qem --voids keep -o " + dir.file("a.ply"));
  EXPECT_NE(ran.answer.find("3 posts uncovered"), std::string::npos) << ran.out;
  EXPECT_NE(ran.answer.find("3 valid posts (20 %) are in no triangle"), std::string::npos)
      << ran.out;
}

TEST(EveryCommandThatWrites, TriesItsOutputBeforeItsInput) {
  const TempDir dir;
  const std::string in = dir.file("missing.tif"), bad = dir.file("no/folder/out");
  std::ofstream(dir.file("kept.ply")) << "kept";
  for (const std::string& command :
       {"simplify " + in + " --ratio 0.5 -o " + bad + ".ply",
        "simplify " + in + " --ratio 0.5 -o " + dir.file("a.ply") + " --report " + bad + ".json",
        "refine " + in + " --bbox 1,2,3,4 -o " + bad + ".ply", "progressive " + in + " -o " + bad,
        "extract " + in + " -o " + bad + ".ply", "between " + in + " " + in + " -o " + bad,
        "compare " + in + " --at 10% --csv " + bad, "compare " + in + " --at 10% --html " + bad,
        "explain " + in + " 0/0/0 --png " + bad}) {
    const Ran ran = run_tind(command);
    EXPECT_EQ(ran.code, 73) << command << "\n" << ran.out;
    EXPECT_NE(ran.out.find("no/folder/out"), std::string::npos) << ran.out;
  }
  EXPECT_EQ(run_tind("simplify " + in + " --ratio 0.5 -o " + dir.file("kept.ply")).code, 69);
  std::string kept;
  std::ifstream(dir.file("kept.ply")) >> kept;
  EXPECT_EQ(kept, "kept");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir.path()), {}), 1);
}

TEST(Program, SaysWhichCommandAMisspellingMayBe) {
  const Ran near = run_tind("simplfy a.tif -o b.ply");
  EXPECT_EQ(near.code, 2);
  EXPECT_NE(near.out.find("no command 'simplfy'; did you mean simplify?"), std::string::npos)
      << near.out;
  const Ran far = run_tind("dem.tif");
  EXPECT_EQ(far.code, 2);
  EXPECT_NE(far.out.find("tind --help"), std::string::npos) << far.out;
  EXPECT_EQ(run_tind("--version").code, 0);
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
  const std::string said = refuses(dir.file("row.asc") + out + " --ratio 0.5", 65);
  EXPECT_NE(said.find("2 x 2"), std::string::npos) << said;
  EXPECT_FALSE(std::filesystem::exists(dir.file("a.ply")));
}

TEST(MeasureCommandLine, SaysWhenMeshAndDemDoNotMeet) {
  const TempDir dir;
  std::ofstream(dir.file("far.obj")) << "v 1e7 1e7 0\nv 1e7 2e7 0\nv 2e7 1e7 0\nf 1 3 2\n";
  const Ran ran = run_tind("measure " + dir.file("far.obj") + " " + testdata("crater.tif"));
  EXPECT_EQ(ran.code, 65);
  EXPECT_NE(ran.out.find("covers no valid post"), std::string::npos) << ran.out;
  EXPECT_EQ(ran.answer, "");  // no figures of nothing
}

/// 36 x 30 posts, 8 x 6 of them void, one more alone at a rim, and one valid post among voids.
std::string dem_with_voids(const TempDir& dir) {
  const std::string path = dir.file("voids.asc");
  std::ofstream out(path);
  out << "ncols 36\nnrows 30\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9999\n";
  for (int r = 0; r < 30; ++r)
    for (int c = 0; c < 36; ++c) {
      const bool in = c > 12 && c < 21 && r > 9 && r < 16 && !(c == 16 && r == 12);
      out << (in || (c == 0 && r == 20) ? -9999 : 100 + (c * 7 + r * 5) % 11 + c) << " \n"[c == 35];
    }
  return path;
}

double area_of(const std::string& mesh) {
  const auto read = read_mesh(mesh);
  EXPECT_TRUE(read) << read.error().what;
  double area = 0;
  for (const auto& [a, b, c] : read->triangles) {
    const auto &p = read->positions[a], &q = read->positions[b], &r = read->positions[c];
    area += ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / 2;
  }
  return area;
}

TEST(SimplifyVoids, AreKeptOrCoveredByAnyMethod) {
  const TempDir dir;
  const std::string dem = dem_with_voids(dir);
  double open_area = 0;
  for (const std::string method : {"qem", "bounded", "greedy", "cluster"}) {
    const std::string line = "simplify " + dem + " --max-error 2 --json --method " + method +
                             " -o " + dir.file("out.ply") + " --error-raster " +
                             dir.file("error.asc");
    for (const std::string voids : {" --voids keep", " --voids cover", ""}) {
      const nlohmann::json made = tind_json(line + voids);
      const bool kept = voids == " --voids keep";
      EXPECT_EQ(made["voids"], kept ? "keep" : "cover") << method << " " << voids;
      EXPECT_EQ(made["posts_uncovered"], kept ? 1 : 0) << method << " " << voids;
      EXPECT_EQ(made["posts_isolated"], kept ? 1 : 0) << method << " " << voids;
      EXPECT_EQ(made["posts_void"], 48) << method << " " << voids;
      EXPECT_LE(made["max_error_m"], 2 + 1e-8) << method << " " << voids;
      EXPECT_EQ(made["flipped"], 0);
      EXPECT_EQ(made["non_manifold"], 0) << method << " " << voids;
      EXPECT_FALSE(made.contains("lines"));
      const double area = area_of(dir.file("out.ply"));
      if (kept && method == "qem") open_area = area;  // which knows nothing else
      EXPECT_NEAR(area, kept ? open_area : 350 * 290, 1e-3) << method << " " << voids;
    }
  }
  EXPECT_LT(open_area, 350 * 290 - 4000);
}

TEST(SimplifyVoids, ThatLeaveNoTriangleAreSaidByEveryMethod) {
  const TempDir dir;
  const std::string head =
      "ncols 5\nnrows 4\nxllcorner 0\nyllcorner 0\ncellsize 10\nnodata_value -9\n";
  std::ofstream(dir.file("diagonal.asc"))
      << head << "1 -9 -9 -9 -9  -9 2 -9 -9 -9  -9 -9 3 -9 -9  -9 -9 -9 4 -9\n";
  std::ofstream(dir.file("none.asc"))
      << head << "-9 -9 -9 -9 -9  -9 -9 -9 -9 -9  -9 -9 -9 -9 -9  -9 -9 -9 -9 -9\n";
  for (const MethodInfo& method : methods())
    for (const auto& [dem, why] : {std::pair("diagonal", "no cell has three valid corners"),
                                   std::pair("none", "the heights are all void")}) {
      const Ran ran = run_tind("simplify " + dir.file(dem + std::string(".asc")) +
                               " --voids keep --ratio 0.5 -o " + dir.file("out.ply") +
                               " --method " + method.name);
      EXPECT_EQ(ran.code, 65) << method.name;
      EXPECT_NE(ran.out.find(why), std::string::npos) << method.name << ran.out;
      EXPECT_FALSE(std::filesystem::exists(dir.file("out.ply"))) << method.name;
      std::filesystem::remove(dir.file("out.ply"));
    }
}

TEST(SimplifyVoids, NeedADem) {
  const TempDir dir;
  const Ran ran =
      run_tind("simplify " + testdata("crater.tif") + " --ratio 0.01 -o " + dir.file("a.ply"));
  ASSERT_EQ(ran.code, 0) << ran.out;
  EXPECT_EQ(run_tind("simplify " + dir.file("a.ply") + " --ratio 0.5 --voids keep -o " +
                     dir.file("b.ply"))
                .code,
            2);
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
