// The program itself: `tind compare`, and general meshes through `tind simplify` and
// `tind measure`.

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/support/program_json.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::run_tind;
using test::TempDir;
using test::testdata;
using test::tind_json;

TEST(CompareCommand, PrintsOneRowForEachMethodAndStopAndWritesAPageThatStandsAlone) {
  const TempDir dir;
  const auto rows =
      tind_json("compare " + testdata("crater.tif") +
                " --methods qem,cluster,vertex-removal:degree --at 10%,500 --json --html " +
                dir.file("page.html") + " --csv " + dir.file("table.csv"));
  ASSERT_EQ(rows.size(), 6u);
  for (const auto& row : rows) {
    EXPECT_EQ(row["flipped"], 0);
    EXPECT_EQ(row["posts_uncovered"], 0);
    EXPECT_GT(row["rms_error_m"], 0);
  }
  EXPECT_EQ(rows[3]["method"], "qem");
  EXPECT_LE(rows[3]["triangles"], 501);
  std::ifstream file(dir.file("page.html"));
  std::stringstream page;
  page << file.rdbuf();
  EXPECT_NE(page.str().find("<svg"), std::string::npos);
  EXPECT_NE(page.str().find("data:image/png;base64,iVBOR"), std::string::npos);
  EXPECT_EQ(page.str().find("://"), std::string::npos);  // nothing is fetched
  EXPECT_EQ(page.str().find("<script"), std::string::npos);
  std::ifstream csv(dir.file("table.csv"));
  std::string head;
  std::getline(csv, head);
  EXPECT_EQ(head.substr(0, 12), "method,stop,");
}

TEST(CompareCommand, ComparesTilesByMethodAndLevel) {
  const auto rows = tind_json("compare " + testdata("bigtujunga_crop.tif") +
                              " --tiles --methods bounded,qem,greedy --json --threads 2");
  ASSERT_EQ(rows.size(), 3u);
  std::set<double> bytes;
  for (const auto& row : rows) {
    double sum = 0, triangles = 0, worst = 0;
    for (const auto& level : row["levels"]) {
      sum += level["bytes"]["all"].get<double>();
      triangles += level["triangles"]["all"].get<double>();
      worst = std::max(worst, level["worst_error_m"].get<double>());
    }
    EXPECT_EQ(sum, row["bytes"]["all"]);
    EXPECT_EQ(triangles, row["triangles"]["all"]);
    EXPECT_EQ(worst, row["worst_error_m"]);
    EXPECT_GT(row["tiles"], 10);
    EXPECT_EQ(row["tiles"], rows[0]["tiles"]);
    EXPECT_EQ(row["by_bounded"], 0);
    bytes.insert(sum);
  }
  EXPECT_EQ(bytes.size(), 3u);
  // What a pyramid cannot have is refused, each with its reason.
  for (const char* wrong : {"--methods cluster", "--at 10%", "--max-error 1,2", "--csv x.csv"})
    EXPECT_NE(run_tind("compare " + testdata("bigtujunga_crop.tif") + " --tiles " + wrong).code, 0)
        << wrong;
  EXPECT_NE(run_tind("compare " + testdata("bigtujunga_crop.tif") + " --at 10% --levels 0-3").code,
            0);
  EXPECT_NE(run_tind("compare " + testdata("bigtujunga_crop.tif")).code, 0);
}

TEST(CompareCommand, ShowsTheErrorsOfAttributesToo) {
  const TempDir dir;
  const auto rows =
      tind_json("compare " + testdata("bigtujunga_crop.tif") +
                " --methods qem,attribute-qem --at 5% --json --csv " + dir.file("table.csv"));
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_FALSE(rows[0].contains("surface"));
  EXPECT_GT(rows[1]["surface"]["normal_error"]["rms"], 0);
  EXPECT_GE(rows[1]["surface"]["normal_error"]["max"], rows[1]["surface"]["normal_error"]["rms"]);
  std::ifstream csv(dir.file("table.csv"));
  std::string line;
  for (int row = 0; std::getline(csv, line); ++row)
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), 15) << line;
}

TEST(CompareCommand, NoRunFindsMemoryThatAnotherLeft) {
  const nlohmann::json rows =
      test::tind_json("compare " + testdata("crater.tif") +
                      " --methods qem,memoryless,cluster,qem,cluster --at 5% --json");
  ASSERT_EQ(rows.size(), 5u);
  const auto alike = [&](int i, int k, const char* key) {
    EXPECT_NEAR(rows[i][key].get<double>() / rows[k][key].get<double>(), 1, 0.15)
        << rows[i]["method"] << " " << key;
  };
  for (const char* key : {"page_faults", "peak_mb"}) alike(0, 3, key), alike(2, 4, key);
  EXPECT_LT(rows[2]["peak_mb"], rows[0]["peak_mb"]);  // cluster needs far less than qem before it
}

TEST(CompareCommand, SaysWhatIsWrong) {
  const std::string dem = testdata("crater.tif");
  EXPECT_EQ(run_tind("compare " + dem + " --at 10% --methods magic").code, 2);
  EXPECT_EQ(run_tind("compare " + dem + " --at ten").code, 2);
  EXPECT_EQ(run_tind("compare " + dem + " --at 10% --max-error 5").code, 2);
}

TEST(MeshCommands, SimplifyAndMeasureAGeneralMesh) {
  const TempDir dir;
  std::ofstream obj(dir.file("box.obj"));
  for (int r = 0; r < 20; ++r)
    for (int c = 0; c < 20; ++c) obj << "v " << c << " " << r << " " << (c * r % 5) * 0.1 << "\n";
  for (int r = 0; r < 19; ++r)
    for (int c = 0; c < 19; ++c) {
      const int i = 20 * r + c + 1;
      obj << "f " << i << " " << i + 1 << " " << i + 21 << " " << i + 20 << "\n";
    }
  obj.close();
  const auto report =
      tind_json("simplify " + dir.file("box.obj") + " -o " + dir.file("out.ply") +
                " --method triangle-collapse --triangles 200 --json --progress none");
  EXPECT_LE(report["triangles"], 201);
  const auto measured =
      tind_json("measure " + dir.file("box.obj") + " " + dir.file("out.ply") + " --json");
  EXPECT_EQ(measured["distance_max"], report["distance_max"]);
}

TEST(MeshCommands, OfNoExtentHaveNoShareOfIt) {
  const TempDir dir;
  const std::string point = dir.file("point.obj");
  std::ofstream(point) << "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n";
  const auto measured = run_tind("measure " + point + " " + point);
  EXPECT_EQ(measured.code, 0) << measured.out;
  EXPECT_NE(measured.out.find("surface distance: max 0, rms 0\n"), std::string::npos)
      << measured.out;
  // Its corners are one vertex.
  const auto made = run_tind("simplify " + point + " -o " + dir.file("out.ply") + " --triangles 1");
  EXPECT_EQ(made.code, 65) << made.out;
  EXPECT_NE(made.out.find("has no triangle"), std::string::npos) << made.out;
}

}  // namespace
}  // namespace tind
