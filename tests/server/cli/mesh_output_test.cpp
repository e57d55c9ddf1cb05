// What `tind simplify` writes besides and about the mesh: formats, rasters, where it is.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "terrain/base/file_io.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/raster/dem_source.h"
#include "tests/support/program_json.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::run_tind;
using test::TempDir;
using test::testdata;
using test::tind_json;
using testing::HasSubstr;

/// 20 x 12 posts, 30 m apart; one void and one post between voids. Row 0 in the north.
std::string small_dem(const TempDir& dir) {
  std::ofstream file(dir.file("dem.asc"));
  file << "ncols 20\nnrows 12\nxllcorner 1000\nyllcorner 2000\ncellsize 30\nnodata_value -9\n";
  for (int r = 0; r < 12; ++r)
    for (int c = 0; c < 20; ++c)
      file << (r == 5 && c == 7 ? -9.0 : (r * 7 + c * c) % 13 + 0.5) << (c < 19 ? ' ' : '\n');
  return dir.file("dem.asc");
}

HeightGrid read_raster(const std::string& path, DemInfo* info = nullptr) {
  const std::string files[] = {path};
  const auto dem = DemSource::open(files);
  EXPECT_TRUE(dem) << dem.error().what;
  if (!dem) return {};
  if (info) *info = (*dem)->info();
  return (*dem)->read(0, 0, int((*dem)->info().cols), int((*dem)->info().rows)).value();
}

TEST(MeshOutput, EveryFormatByExtensionAndByName) {
  const TempDir dir;
  const std::string start = "simplify " + small_dem(dir) + " --ratio 0.5 --method qem -o ";
  for (const MeshFormat& f : mesh_formats()) {
    const std::string by_extension = dir.file(std::string("a") + f.extensions.front());
    const std::string by_name = dir.file("b." + std::string(f.name) + ".out");
    EXPECT_EQ(tind_json(start + by_extension + " --json")["format"], f.name);
    EXPECT_EQ(tind_json(start + by_name + " --json --format " + f.name)["format"], f.name);
    EXPECT_EQ(read_whole_file(by_name).value(), read_whole_file(by_extension).value()) << f.name;
  }
  const auto unknown = run_tind(start + dir.file("a.xyz"));
  EXPECT_EQ(unknown.code, 2);
  for (const MeshFormat& f : mesh_formats())
    EXPECT_THAT(unknown.out, HasSubstr(f.extensions.front()));
  // Before any work: the DEM is not there at all.
  EXPECT_EQ(run_tind("simplify none.tif --ratio 0.5 -o " + dir.file("a.xyz")).code, 2);
  EXPECT_EQ(run_tind("refine none.tif --bbox 1,2,3,4 -o " + dir.file("a.xyz")).code, 2);
  EXPECT_EQ(run_tind("extract none.tpm -o " + dir.file("a.xyz")).code, 2);
}

TEST(MeshOutput, FormatsListsThemAll) {
  const auto listed = tind_json("formats --json");
  ASSERT_EQ(listed.size(), mesh_formats().size());
  const auto text = run_tind("formats");
  EXPECT_EQ(text.code, 0);
  for (const MeshFormat& f : mesh_formats()) EXPECT_THAT(text.answer, HasSubstr(f.title));
}

TEST(MeshOutput, WhatAFormatCannotCarryIsRefusedFirst) {
  const TempDir dir;
  const std::string degrees = "simplify " + testdata("rainier.tif") + " --ratio 0.01 ";
  const auto xml = run_tind(degrees + "-o " + dir.file("a.xml"));
  EXPECT_EQ(xml.code, 2);
  EXPECT_THAT(xml.out, HasSubstr("--frame metric"));
  EXPECT_EQ(run_tind(degrees + "--frame metric -o " + dir.file("a.xml")).code, 0);
  const auto drape =
      run_tind("simplify none.tif --ratio 0.5 --method attribute-qem --drape none.png -o " +
               dir.file("a.2dm"));
  EXPECT_EQ(drape.code, 2);
  EXPECT_THAT(drape.out, HasSubstr("colours"));
}

TEST(MeshOutput, RastersHoldTheMeshAndItsErrors) {
  const TempDir dir;
  const std::string dem = small_dem(dir), mesh = dir.file("a.ply");
  for (const std::string extension : {".tif", ".asc"}) {
    const std::string heights = dir.file("h" + extension), errors = dir.file("e" + extension);
    const auto made = tind_json("simplify " + dem + " --ratio 0.3 --method qem --json -o " + mesh +
                                " --raster " + heights + " --error-raster " + errors);
    DemInfo info;
    const HeightGrid posts = read_raster(dem), h = read_raster(heights, &info),
                     e = read_raster(errors);
    ASSERT_EQ(h.size(), posts.size());
    EXPECT_EQ(info.post_to_crs, (Affine{1015, 30, 0, 2345, 0, -30})) << extension;
    double worst = 0, sum = 0, above = 0;
    std::uint64_t covered = 0;
    for (std::size_t i = 0; i < posts.size(); ++i) {
      const double error = double(e.values()[i]), post = double(posts.values()[i]);
      EXPECT_EQ(std::isnan(error), std::isnan(post) || std::isnan(h.values()[i]));
      if (std::isnan(error)) continue;
      EXPECT_NEAR(double(h.values()[i]) - post, error, 1e-5);
      worst = std::max(worst, std::fabs(error));
      sum += error;
      above += std::max(0.0, error);
      ++covered;
    }
    EXPECT_EQ(covered, made["posts"]);
    EXPECT_NEAR(worst, made["max_error_m"], 1e-6);
    EXPECT_NEAR(sum / double(covered), made["bias_m"], 1e-6);
    EXPECT_NEAR(sum * 900, made["volume_m3"]["net"], 1e-2);
    EXPECT_NEAR(above * 900, made["volume_m3"]["above"], 1e-2);
    EXPECT_EQ(made["posts_void"], 1);
    EXPECT_EQ(made["posts"].get<int>() + made["posts_uncovered"].get<int>() +
                  made["posts_void"].get<int>(),
              240);
  }
}

TEST(MeshOutput, ARasterNamesTheDatumOfItsHeights) {
  const TempDir dir;
  const std::string start = "simplify " + testdata("rainier.tif") + " --ratio 0.01 -o " +
                            dir.file("a.ply") + " --from-datum egm96 --raster " +
                            dir.file("h.tif") + " --error-raster " + dir.file("e.tif");
  tind_json(start + " --json");
  DemInfo info;
  read_raster(dir.file("h.tif"), &info);
  EXPECT_EQ(info.source_datum, VerticalDatum::egm96);
  read_raster(dir.file("e.tif"), &info);
  EXPECT_EQ(info.source_datum, VerticalDatum::unknown);
  tind_json(start + " --json --to-datum ellipsoid");
  read_raster(dir.file("h.tif"), &info);
  EXPECT_EQ(info.source_datum, VerticalDatum::ellipsoid);
}

TEST(MeshOutput, ARasterOfAProjectedDemKeepsItsCrsWhateverItsDatum) {
  const TempDir dir;
  std::ofstream(dir.file("u.asc"))
      << "ncols 4\nnrows 2\nxllcorner 500000\nyllcorner 5700000\ncellsize 30\n1 2 3 4\n5 7 6 5\n";
  const std::string start = "simplify " + dir.file("u.asc") +
                            " --crs EPSG:25832 --max-error 0.001 -o " + dir.file("a.ply") +
                            " --raster " + dir.file("h.tif");
  for (const char* datum :
       {"ellipsoid", "egm84", "egm96", "egm2008", "EPSG:5783", "EPSG:4258+5783", "EPSG:6360"}) {
    const auto ran = run_tind(start + " --from-datum " + datum);
    ASSERT_EQ(ran.code, 0) << ran.out;
    DemInfo info;
    const std::string said = datum;
    const double metres = said == "EPSG:6360" ? 7 * 1200 / 3937. : 7;  // it counts in US feet
    EXPECT_NEAR(read_raster(dir.file("h.tif"), &info).at(1, 1), metres, 0.0011) << datum;
    EXPECT_THAT(info.crs_name, HasSubstr("UTM zone 32N")) << datum;
    const bool in_crs = said != "ellipsoid" && said != "EPSG:6360";  // heights are metres now
    if (in_crs) {
      EXPECT_NE(info.source_datum, VerticalDatum::unknown) << datum;
    } else {
      EXPECT_THAT(read_whole_file(dir.file("h.tif")).value(),
                  HasSubstr("<Item name=\"VERTICAL_DATUM\">" + said + "</Item>"));
    }
  }
}

TEST(MeshOutput, RastersThatCannotBeAreRefused) {
  const TempDir dir;
  const std::string dem = small_dem(dir);
  const std::string start =
      "simplify " + dem + " --ratio 0.5 -o " + dir.file("a.ply") + " --raster ";
  EXPECT_EQ(run_tind(start + dir.file("a.png")).code, 2);
  EXPECT_EQ(run_tind(start + dem).code, 2);
  EXPECT_EQ(run_tind(start + dir.file("a.tif") + " --error-raster " + dir.file("a.tif")).code, 2);
  EXPECT_EQ(run_tind(start + dir.file("no/such/a.tif")).code, 73);
  std::ofstream(dir.file("m.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  EXPECT_EQ(run_tind("simplify " + dir.file("m.obj") + " --ratio 0.5 -o " + dir.file("a.ply") +
                     " --raster " + dir.file("a.tif"))
                .code,
            2);
  EXPECT_FALSE(std::filesystem::exists(dir.file("a.ply")));
}

TEST(MeshOutput, TheMetricFrameSaysHowToGetBack) {
  const TempDir dir;
  const std::string start =
      "simplify " + testdata("rainier.tif") + " --ratio 0.01 --method greedy --json -o ";
  const auto there = tind_json(start + dir.file("s.ply"));
  const auto made = tind_json(start + dir.file("m.ply") + " --frame metric");
  EXPECT_EQ(there["epsg"], 4326);
  EXPECT_THAT(there["crs_wkt"].get<std::string>(), HasSubstr("WGS"));
  EXPECT_FALSE(there.contains("origin"));
  const auto in_crs = read_mesh(dir.file("s.ply")), local = read_mesh(dir.file("m.ply"));
  ASSERT_TRUE(in_crs && local);
  const auto o = made["origin"].get<std::vector<double>>(),
             t = made["metres_to_crs"].get<std::vector<double>>();
  for (std::size_t i = 0; i < local->positions.size(); ++i) {
    const auto& [x, y, z] = local->positions[i];
    EXPECT_NEAR(o[0] + t[0] * x + t[1] * y, in_crs->positions[i][0], 1e-11);
    EXPECT_NEAR(o[1] + t[2] * x + t[3] * y, in_crs->positions[i][1], 1e-11);
  }
  EXPECT_THAT(read_whole_file(dir.file("s.ply")).value(), HasSubstr("\ncomment crs: EPSG:4326\n"));
  EXPECT_THAT(read_whole_file(dir.file("m.ply")).value(), HasSubstr("\ncomment origin: "));
}

TEST(MeshOutput, RefineAndExtractSayWhereTheirMeshIs) {
  const TempDir dir;
  const std::string dem = testdata("bigtujunga_crop.tif");
  const auto refined = tind_json("refine " + dem + " --bbox -118.2,34.3,-118.1,34.4 --inside 20 " +
                                 "--outside 50 --frame metric --json -o " + dir.file("a.fgb"));
  EXPECT_EQ(refined["epsg"], 32611);
  EXPECT_EQ(refined["origin"].size(), 2u);
  EXPECT_EQ(refined["format"], "fgb");
  ASSERT_EQ(run_tind("progressive " + dem + " --method qem -o " + dir.file("a.tpm")).code, 0);
  const auto level =
      tind_json("extract " + dir.file("a.tpm") + " --max-error 50 --json -o " + dir.file("a.nc"));
  EXPECT_EQ(level["epsg"], 32611);
  EXPECT_FALSE(level.contains("origin"));
  EXPECT_THAT(read_whole_file(dir.file("a.nc")).value(), HasSubstr("EPSG:32611"));
}

TEST(MeshOutput, MeasureAndCompareReadWhatSimplifyWrites) {
  const TempDir dir;
  const std::string dem = testdata("bigtujunga_crop.tif");
  const auto made = tind_json("simplify " + dem + " --max-error 20 --json -o " + dir.file("a.xml"));
  const auto found = tind_json("measure " + dir.file("a.xml") + " " + dem + " --json");
  for (const char* key : {"max_error_m", "bias_m"}) EXPECT_NEAR(found[key], made[key], 1e-9) << key;
  EXPECT_NEAR(found["volume_m3"]["net"], made["volume_m3"]["net"], 1);
  EXPECT_EQ(found["epsg"], 32611);
  tind_json("simplify " + dir.file("a.xml") + " --ratio 0.5 --json -o " + dir.file("b.2dm"));
  EXPECT_GT(tind_json("measure " + dir.file("b.2dm") + " " + dir.file("a.xml") + " --json").size(),
            2u);
}

TEST(MeshInput, KeepsAndCountsWhatItsFileSaysOfItsPlace) {
  const TempDir dir;
  const std::string dem = testdata("rainier.tif");
  const std::string start = "simplify " + dem + " --from-datum egm96 --max-error 20 -o ";
  ASSERT_EQ(run_tind(start + dir.file("a.ply") + " --frame metric").code, 0);
  ASSERT_EQ(run_tind(start + dir.file("b.ply")).code, 0);
  // In the frame that the file names, without being told.
  const auto by_file = tind_json("measure " + dir.file("a.ply") + " " + dem + " --json");
  const auto told =
      tind_json("measure " + dir.file("a.ply") + " " + dem + " --frame metric --json");
  EXPECT_EQ(by_file["posts"], told["posts"]);
  EXPECT_NEAR(by_file["max_error_m"], told["max_error_m"], 1e-6);
  EXPECT_LT(by_file["max_error_m"], 20.0001);
  // Another datum is said.
  EXPECT_NE(run_tind("measure " + dir.file("b.ply") + " " + dem +
                     " --from-datum egm96 --to-datum ellipsoid")
                .out.find("above egm96, not ellipsoid"),
            std::string::npos);
  // And it goes from mesh to mesh.
  ASSERT_EQ(run_tind("simplify " + dir.file("a.ply") + " --ratio .5 -o " + dir.file("c.obj")).code,
            0);
  const auto info = tind_json("info " + dir.file("c.obj") + " --json");
  EXPECT_EQ(info["vertical_datum"], "egm96");
  EXPECT_EQ(info["epsg"], 4326);
  EXPECT_EQ(info["origin"], tind_json("info " + dir.file("a.ply") + " --json")["origin"]);
  const auto refused =
      run_tind("simplify " + dir.file("a.ply") + " --nodata 3 --ratio .5 -o " + dir.file("d.obj"));
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.out.find("--nodata is said of DEMs"), std::string::npos);
}

TEST(MeshInput, DegreesAreNoSurfaceInSpace) {
  const TempDir dir;
  const std::string dem = testdata("rainier.tif");
  const std::string degrees = dir.file("degrees.ply"), coarse = dir.file("coarse.ply"),
                    metres = dir.file("metres.ply"), tpm = dir.file("a.tpm");
  const std::string start = "simplify " + dem + " --method greedy -o ";
  ASSERT_EQ(run_tind(start + degrees + " --ratio 0.01").code, 0);
  ASSERT_EQ(run_tind(start + coarse + " --ratio 0.001").code, 0);
  ASSERT_EQ(run_tind(start + metres + " --ratio 0.01 --frame metric").code, 0);
  for (const std::string& line :
       {"progressive " + degrees + " -o " + tpm,
        "progressive " + degrees + " --method attribute-qem -o " + tpm,
        "between " + degrees + " " + coarse + " -o " + tpm,
        "between " + metres + " " + degrees + " -o " + tpm,
        "simplify " + degrees + " --ratio 0.2 -o " + dir.file("b.ply"),
        "measure " + degrees + " " + coarse, "measure " + metres + " " + degrees}) {
    const auto refused = run_tind(line);
    EXPECT_EQ(refused.code, 65) << line << refused.out;
    EXPECT_THAT(refused.out, HasSubstr("degrees.ply: its x and y are degrees")) << line;
    EXPECT_THAT(refused.out, HasSubstr("--frame metric")) << line;
  }
  EXPECT_FALSE(std::filesystem::exists(tpm));
  EXPECT_FALSE(std::filesystem::exists(dir.file("b.ply")));
  // Heights are vertical whatever x and y are, and metres have distances.
  for (const std::string& line :
       {"measure " + degrees + " " + dem, "measure " + coarse + " " + degrees + " --terrain",
        "simplify " + degrees + " --terrain --ratio 0.2 -o " + dir.file("c.ply"), "info " + degrees,
        "progressive " + metres + " -o " + tpm, "measure " + metres + " " + metres,
        "simplify " + metres + " --ratio 0.2 -o " + dir.file("d.ply")})
    EXPECT_EQ(run_tind(line).code, 0) << line;
}

TEST(MeshOutput, AGeoPackageWithoutACrsHasLengths) {
  const TempDir dir;
  const std::string line = "simplify " + small_dem(dir) + " --ratio 0.5 -o " + dir.file("m.gpkg");
  ASSERT_EQ(run_tind(line).code, 0);
  const std::string bytes = read_whole_file(dir.file("m.gpkg")).value();
  // Of a geometry: "GP", version, flags, srs_id: -1 is "undefined Cartesian", 0 were degrees.
  EXPECT_NE(bytes.find(std::string("GP\0\x05\xff\xff\xff\xff", 8)), bytes.npos);
  EXPECT_EQ(bytes.find(std::string("GP\0\x05\0\0\0\0", 8)), bytes.npos);
  // So have contours of it.
  const std::string contours = dir.file("c.gpkg");
  ASSERT_EQ(run_tind("contours " + small_dem(dir) + " --interval 1 -o " + contours).code, 0);
  const std::string lines = read_whole_file(contours).value();
  EXPECT_NE(lines.find(std::string("GP\0\x05\xff\xff\xff\xff", 8)), lines.npos);
  EXPECT_EQ(lines.find(std::string("GP\0\x05\0\0\0\0", 8)), lines.npos);
}

TEST(MeshOutput, FeetBesideMetresAreTold) {
  const TempDir dir;
  const std::string line = "simplify " + small_dem(dir) + " --crs EPSG:2227 --ratio 0.5 -o ";
  const auto ran = run_tind(line + dir.file("m.obj"));
  EXPECT_EQ(ran.code, 0);
  EXPECT_NE(ran.out.find("x and y are in units of 0.3048006096 m and z in units of 1 m"),
            ran.out.npos)
      << ran.out;
  EXPECT_EQ(run_tind(line + dir.file("n.obj") + " --frame metric").out.find("units of"),
            ran.out.npos);
}

}  // namespace
}  // namespace tind
