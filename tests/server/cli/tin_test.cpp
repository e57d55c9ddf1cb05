// The program itself with terrain that is a mesh already: `tind simplify`, `tind measure` and
// `tind compare` of a TIN.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "terrain/mesh/mesh_file.h"
#include "tests/support/program_json.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::Ran;
using test::run_tind;
using test::TempDir;
using test::testdata;
using test::tind_json;
using testing::HasSubstr;
using testing::Not;

/// A TIN of some thousand triangles of testdata/NAME, in the DEM's own CRS.
std::string tin_of(const TempDir& dir, const std::string& name, const std::string& file) {
  const std::string path = dir.file(file);
  const Ran ran = run_tind("simplify " + testdata(name) + " --method greedy --triangles 4000 -o " +
                           path + " --progress none");
  EXPECT_EQ(ran.code, 0) << ran.out;
  return path;
}

TEST(MeshCommands, SimplifyKeepsTheTextureAndSaysWhatItDoesNot) {
  const TempDir dir;
  std::filesystem::create_directories(dir.path() / "out");
  std::ofstream obj(dir.file("a.obj"));
  obj << "mtllib a.mtl\nusemtl m\n";
  for (int i = 0; i < 100; ++i)
    obj << "v " << i % 10 << ' ' << i / 10 << ' ' << i * i % 7 << "\nvt " << i % 10 / 9.0 << ' '
        << i / 10 / 9.0 << '\n';
  for (int i = 0; i < 90; ++i)
    if (i % 10 < 9)
      obj << "f " << i + 1 << '/' << i + 1 << ' ' << i + 2 << '/' << i + 2 << ' ' << i + 11 << '/'
          << i + 11 << '\n';
  obj.close();
  std::ofstream(dir.file("a.mtl")) << "newmtl m\nmap_Kd photo.png\n";
  const std::string line = "simplify " + dir.file("a.obj") + " --ratio 0.5 -o " + dir.file("out/b");
  const Ran ran = run_tind(line + ".obj --method qem");
  EXPECT_EQ(ran.code, 0) << ran.out;
  const auto made = read_mesh(dir.file("out/b.obj"));
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_EQ(made->texture, "../photo.png");
  EXPECT_FALSE(made->texcoords.empty());
  EXPECT_THAT(run_tind(line + ".ply --method triangle-collapse").out,
              HasSubstr("carries no texture coordinates"));
  EXPECT_EQ(run_tind(line + ".ply --method attribute-qem --attribute-weight 1e50").code, 2);
}

TEST(MeshCommands, CornersWithoutANormalHaveThatOfTheShape) {
  const TempDir dir;
  std::ofstream(dir.file("part.obj")) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\n"
                                         "f 1//1 2//1 3//1\nf 1 3 4\n";
  const Ran ran = run_tind("simplify " + dir.file("part.obj") +
                           " --ratio 1 --method attribute-qem -o " + dir.file("out.obj"));
  ASSERT_EQ(ran.code, 0) << ran.out;
  const auto made = read_mesh(dir.file("out.obj"));
  ASSERT_TRUE(made) << made.error().what;
  ASSERT_FALSE(made->normals.empty());
  for (const auto& n : made->normals) EXPECT_NEAR(std::hypot(n[0], n[1], n[2]), 1, 1e-5);
}

TEST(MeshCommands, ACodeOfACrsIsACrsForFormatsThatTakeNoCode) {
  const TempDir dir;
  std::ofstream(dir.file("a.ply"))
      << "ply\nformat ascii 1.0\ncomment crs: EPSG:32610\nelement vertex 4\nproperty double x\n"
         "property double y\nproperty double z\nelement face 2\n"
         "property list uchar int vertex_indices\nend_header\n500000 5200000 1\n500010 5200000 2\n"
         "500010 5200010 3\n500000 5200010 4\n3 0 1 2\n3 0 2 3\n";
  const Ran ran = run_tind("simplify " + dir.file("a.ply") + " --ratio 1 --terrain --json -o " +
                           dir.file("a.gpkg"));
  ASSERT_EQ(ran.code, 0) << ran.out;
  EXPECT_THAT(ran.answer, HasSubstr("UTM zone 10N"));
  EXPECT_THAT(run_tind("info " + dir.file("a.gpkg")).out, HasSubstr("UTM zone 10N"));
}

/// Two triangles a surface of LandXML, each a hundred metres beside the one before.
std::string surfaces(const TempDir& dir, const std::vector<std::string>& names) {
  const std::string path = dir.file("s.xml");
  std::ofstream out(path);
  out << R"(<LandXML><Units><Metric linearUnit="meter"/></Units><Surfaces>)";
  int x = 0;
  for (const std::string& name : names) {
    out << "<Surface name=\"" << name << R"("><Definition surfType="TIN"><Pnts>)";
    out << "<P id=\"1\">0 " << x << " 1</P><P id=\"2\">0 " << x + 50 << " 1</P><P id=\"3\">50 " << x
        << " 1</P><P id=\"4\">50 " << x + 50 << " 2</P></Pnts>"
        << "<Faces><F>1 2 3</F><F>2 4 3</F></Faces></Definition></Surface>";
    x += 100;
  }
  out << "</Surfaces></LandXML>";
  return path;
}

TEST(MeshCommands, SurfacesThatBecomeOneMeshAreTold) {
  const TempDir dir;
  const std::string told = "its 2 surfaces (EG, FG) are taken together, as one mesh";
  std::string path = surfaces(dir, {"EG", "FG"});
  const std::string out = " --progress none -o " + dir.file("o.ply");
  for (const std::string& command :
       {"info " + path, "volume " + path + " --height 0",
        "simplify " + path + " --terrain --ratio 1" + out, "simplify " + path + " --ratio 1" + out,
        "slope " + path + " --posts 10 -o " + dir.file("o.asc")}) {
    const Ran ran = run_tind(command);
    EXPECT_EQ(ran.code, 0) << command << "\n" << ran.out;
    EXPECT_THAT(ran.out, HasSubstr("warning: " + path + ": " + told)) << command;
  }
  const std::string odd(100, 'x');
  path = surfaces(dir, {odd, "", "c", "d", "e", "f"});
  EXPECT_THAT(run_tind("info " + path).out,
              HasSubstr("its 6 surfaces (" + std::string(60, 'x') +
                        "..., unnamed, c, d and 2 more) are taken together"));
  path = surfaces(dir, {"EG"});
  EXPECT_THAT(run_tind("info " + path).out, Not(HasSubstr("warning")));
}

TEST(TinCommands, WhatSimplifyStatesIsWhatMeasureFinds) {
  const TempDir dir;
  for (const char* name : {"rainier.tif", "crater.tif"}) {  // degrees; no CRS
    for (const char* file : {"tin.ply", "tin.2dm"}) {
      const std::string tin = tin_of(dir, name, file);
      for (const char* how :
           {"--method edge-cost --ratio 0.1", "--method vertex-removal --ratio 0.1",
            "--method edge-cost --placement fit --ratio 0.1", "--max-error 20",
            "--terrain --ratio 0.1", "--terrain --method qem --subset-placement --ratio 0.1",
            "--method greedy --max-error 20"}) {
        SCOPED_TRACE(std::string(name) + " " + file + " " + how);
        const std::string out = dir.file("out.ply");
        const auto said =
            tind_json("simplify " + tin + " -o " + out + " --json --progress none " + how);
        EXPECT_EQ(said["flipped"], 0);
        EXPECT_EQ(said["vertices_uncovered"], 0);
        EXPECT_GT(said["input_triangles"], 3990);
        const bool bound = std::string(how).find("--max-error") != std::string::npos;
        if (bound)
          EXPECT_LE(said["max_error_m"], 20.0 + 1e-7);
        else
          EXPECT_LE(said["triangles"], 400);
        const auto found = tind_json("measure " + out + " " + tin + " --terrain --json");
        for (const char* key :
             {"max_error_m", "rms_error_m", "p95_m", "bias_m", "vertices_measured", "max_at"})
          EXPECT_EQ(found[key], said[key]) << key;
      }
    }
  }
}

TEST(TinCommands, FilesOfThirtyTwoBitsAreMeasuredAsTheyAreRead) {
  const TempDir dir;
  const std::string tin = tin_of(dir, "crater.tif", "tin.ply");
  for (const char* file : {"out.stl", "out.glb"}) {
    const auto said = tind_json("simplify " + tin + " -o " + dir.file(file) +
                                " --json --progress none --method edge-cost --ratio 0.1");
    EXPECT_EQ(said["vertices_uncovered"], 0) << file;
  }
  const auto found = tind_json("measure " + dir.file("out.stl") + " " + tin + " --terrain --json");
  EXPECT_EQ(found["vertices_uncovered"], 0);
}

TEST(TinCommands, AStepInTheTinIsNoBugOfTheMethod) {
  const TempDir dir;
  std::ofstream(dir.file("step.obj")) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                         "v 1 0 5\nv 2 0 5\nv 2 1 5\nv 1 1 5\n"
                                         "f 1 2 3\nf 1 3 4\nf 5 6 7\nf 5 7 8\n";
  const auto said = tind_json("simplify " + dir.file("step.obj") + " -o " + dir.file("out.ply") +
                              " --terrain --method qem --max-error 1 --json --progress none");
  EXPECT_EQ(said["max_error_m"], 5);
  EXPECT_THAT(std::string(said["note"]), HasSubstr("a step along a seam"));
}

TEST(TinCommands, CompareHasARowForEachMethodOverTheVertices) {
  const TempDir dir;
  const std::string tin = tin_of(dir, "crater.tif", "tin.ply");
  const auto rows = tind_json("compare " + tin +
                              " --methods bounded,qem,edge-cost,vertex-removal:degree --at 20% "
                              "--json --csv " +
                              dir.file("table.csv"));
  ASSERT_EQ(rows.size(), 4u);
  for (const auto& row : rows) {
    EXPECT_EQ(row["flipped"], 0);
    EXPECT_EQ(row["vertices_uncovered"], 0);
    EXPECT_GT(row["rms_error_m"], 0);
  }
  EXPECT_LT(rows[0]["rms_error_m"], rows[2]["rms_error_m"]);
  EXPECT_THAT(run_tind("compare " + tin + " --at 20% --html " + dir.file("a.html")).out,
              HasSubstr("need a DEM"));
}

TEST(TinCommands, SayInOneLineWhatCannotBe) {
  const TempDir dir;
  const std::string tin = tin_of(dir, "crater.tif", "tin.ply");
  const auto refused = [&](const std::string& line, const char* why) {
    const Ran ran = run_tind(line);
    EXPECT_NE(ran.code, 0) << line;
    EXPECT_THAT(ran.out, HasSubstr(why)) << line;
  };
  const std::string out = " -o " + dir.file("x.ply");
  refused("simplify " + tin + out + " --method cluster --ratio 0.5", "'cluster' is for rasters");
  refused("simplify " + tin + out + " --method qem --placement fit --ratio 0.5",
          "--placement is for");
  refused("simplify " + tin + out + " --method edge-cost --placement centroid --ratio 0.5",
          "midpoint or fit");
  refused("simplify " + testdata("crater.tif") + out + " --terrain --ratio 0.5", "is for a mesh");
  refused("measure " + tin + " " + testdata("crater.tif") + " --terrain", "is for a mesh");
  std::ofstream(dir.file("wall.obj")) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 1 0 5\nf 1 2 3\nf 2 3 4\n";
  refused("simplify " + dir.file("wall.obj") + out + " --terrain --ratio 0.5", "wall.obj");
  refused("simplify " + dir.file("wall.obj") + out + " --terrain --ratio 0.5", "vertical face");
  // A surface in space stays one.
  EXPECT_EQ(run_tind("simplify " + dir.file("wall.obj") + out + " --ratio 0.5").code, 0);
}

}  // namespace
}  // namespace tind
