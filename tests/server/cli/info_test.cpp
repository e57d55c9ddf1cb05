// tind info as its users run it: the program, its exit code, its JSON.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "proto/tile/layer_json.h"
#include "tests/support/flat_dem.h"
#include "tests/support/program.h"
#include "tests/support/support.h"

namespace {

using tind::test::Ran;
using tind::test::testdata;

Ran info(const std::string& arguments) { return tind::test::run_tind("info " + arguments); }

nlohmann::json json_of(const std::string& arguments) {
  const Ran outcome = info(arguments + " --json");
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  return nlohmann::json::parse(outcome.answer, nullptr, false);
}

TEST(Info, Dem) {
  const auto j = json_of(testdata("rainier.tif"));
  EXPECT_EQ(j["kind"], "dem");
  EXPECT_EQ(j["cols"], 577);
  EXPECT_EQ(j["rows"], 481);
  EXPECT_EQ(j["min_height_m"], 312);
  EXPECT_EQ(j["max_height_m"], 4371);
  EXPECT_EQ(j["voids"], 4517);
  EXPECT_EQ(j["statistics"], "all posts");
  EXPECT_EQ(j["datum"], "egm96");
  EXPECT_EQ(j["plain_geographic"], true);
  EXPECT_NEAR(j["bounds"][0].get<double>(), -121.98, 1e-9);
  const auto shifted = json_of(testdata("rainier.tif") + " --to-datum ellipsoid");
  EXPECT_EQ(shifted["datum"], "ellipsoid");
  EXPECT_EQ(shifted["source_datum"], "egm96");
  EXPECT_NEAR(shifted["max_height_m"].get<double>(), 4371 - 18.5, 1.5);
}

TEST(Info, OneHeightAmongVoidsIsNotNone) {
  const tind::test::TempDir dir;
  std::ofstream text(dir.file("d.asc"));
  text << "ncols 300\nnrows 300\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value -9\n1";
  for (int i = 1; i < 300 * 300; ++i) text << " -9";
  text.close();
  const Ran one = info(dir.file("d.asc"));
  EXPECT_THAT(one.out, testing::HasSubstr("voids      89999 (99.999 %)"));
  EXPECT_THAT(info(dir.path().string() + "/d.asc " + testdata("rainier.tif")).out,
              testing::HasSubstr(" 1 .. 1 m, 99.999 % void"));
}

TEST(Info, OfALargeDemASampleUnlessAllIsAskedFor) {
  const tind::test::TempDir dir;
  const std::string script =
      (std::filesystem::path(testdata("")) / "../scripts/make_large_dem").string();
  ASSERT_EQ(std::system((script + " " + dir.file("dem") + " --side 6000 >/dev/null").c_str()), 0);
  const std::string dem = dir.file("dem/large.vrt") + " --allow-vrt";
  const auto sampled = json_of(dem);
  EXPECT_EQ(sampled["cols"], 6000);
  EXPECT_EQ(sampled["statistics"], "sample");
  for (const char* exact : {"min_height_m", "max_height_m", "voids", "void_share"})
    EXPECT_TRUE(sampled.at(exact).is_null()) << exact;
  const auto all = json_of(dem + " --stats");
  EXPECT_EQ(all["statistics"], "all posts");
  EXPECT_FALSE(all.contains("sample"));
  EXPECT_EQ(all["voids"], 0);
  EXPECT_EQ(all["fingerprint"], sampled["fingerprint"]);
  const auto& sample = sampled["sample"];
  EXPECT_GT(sample["posts"], 1'000'000);
  EXPECT_LT(sample["posts"], 36'000'000);
  EXPECT_GE(sample["min_height_m"], all["min_height_m"]);
  EXPECT_LE(sample["max_height_m"], all["max_height_m"]);
  EXPECT_LT(sample["min_height_m"], sample["max_height_m"]);
  EXPECT_THAT(info(dem).out, testing::HasSubstr("--stats"));
  EXPECT_THAT(info(dem + " --stats").out, testing::Not(testing::HasSubstr("--stats")));
}

TEST(Info, WhatIsKnownWithoutPostsIsSaidBeforeTheyAreRead) {
  const tind::test::TempDir folder;
  std::filesystem::copy_file(testdata("rainier.tif"), folder.file("cut.tif"));
  std::filesystem::resize_file(folder.file("cut.tif"), 200000);
  const Ran cut = info(folder.file("cut.tif"));
  EXPECT_EQ(cut.code, 65);
  EXPECT_THAT(cut.answer, testing::HasSubstr("577 x 481"));
  EXPECT_THAT(cut.answer, testing::Not(testing::HasSubstr("voids")));
  EXPECT_EQ(info(folder.file("cut.tif") + " --json").answer, "");
}

TEST(Info, DemWithoutCrs) {
  const auto j = json_of(testdata("crater.tif"));
  EXPECT_EQ(j["crs"]["kind"], "none");
  EXPECT_FALSE(j.contains("bounds"));
  EXPECT_THAT(info(testdata("crater.tif")).out, testing::HasSubstr("can be simplified"));
}

/// Whose name may turn a terminal's colours, or its lines.
TEST(Info, AnEscapeInACrsComesToNoTerminal) {
  const tind::test::TempDir folder;
  tind::test::write_flat_dem(folder.file("a.asc"), 1);
  std::ofstream(folder.file("a.prj"))
      << "GEOGCS[\"red\x1b[31m\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137.0,298."
         "257223563]],"
         "PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]]";
  const Ran outcome = info(folder.file("a.asc"));
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  EXPECT_THAT(outcome.out, testing::HasSubstr("red\\x1b[31m"));
  EXPECT_EQ(outcome.out.find('\x1b'), std::string::npos);
}

TEST(Info, TilesOfOtherMakers) {
  TIND_NEEDS_SHARED_DATA(tile,
                         "quantized-mesh/cesium-native/tile.octvertexnormals.watermask.terrain");
  const auto j = json_of(tile);
  EXPECT_EQ(j["vertices"], 218);
  EXPECT_EQ(j["triangles"], 400);
  EXPECT_EQ(j["extensions"], nlohmann::json::parse(R"(["octvertexnormals", "watermask"])"));
}

TEST(Info, TileSet) {
  const tind::test::TempDir folder;
  tind::proto::LayerJson layer;
  layer.name = "alps";
  layer.maxzoom = 1;
  layer.available = {{{0, 0, 1, 0}}, {{2, 0, 3, 1}}};
  std::ofstream(folder.file("layer.json")) << tind::proto::encode_layer_json(layer);
  const auto j = json_of(folder.path().string());
  EXPECT_EQ(j["name"], "alps");
  EXPECT_EQ(j["levels"][0]["tiles"], 2);
  EXPECT_EQ(j["levels"][1]["tiles"], 4);
  EXPECT_EQ(j["box"], j["bounds"]);
  EXPECT_EQ(info(folder.path().string()).out.find("\nbox "), std::string::npos);
  layer.available = {{{0, 0, 1, 0}}, {{0, 1, 0, 1}, {3, 1, 3, 1}}};  // across the antimeridian
  std::ofstream(folder.file("layer.json")) << tind::proto::encode_layer_json(layer);
  EXPECT_EQ(json_of(folder.path().string())["box"], nlohmann::json({90., -90., 270., 90.}));
  EXPECT_NE(info(folder.path().string()).out.find("box        90.000000 -90.000000 270"),
            std::string::npos);
}

TEST(Info, ExitCodesSayWhatIsWrong) {
  const tind::test::TempDir folder;
  EXPECT_EQ(info(folder.file("none.tif")).code, 69);
  EXPECT_EQ(info(folder.path().string()).code, 69);  // no layer.json
  EXPECT_EQ(info("").code, 2);
  EXPECT_EQ(info(testdata("README.md")).code, 65);
  std::ofstream(folder.file("bad.terrain")) << "not a tile";
  EXPECT_EQ(info(folder.file("bad.terrain")).code, 65);
  std::filesystem::copy_file(testdata("rainier.tif"), folder.file("cut.tif"));
  std::filesystem::resize_file(folder.file("cut.tif"), 200000);
  const Ran cut = info(folder.file("cut.tif"));
  EXPECT_EQ(cut.code, 65);
  EXPECT_THAT(cut.out, testing::HasSubstr("tind: "));
  EXPECT_THAT(cut.out, testing::HasSubstr("cut.tif"));
}

TEST(Info, Meshes) {
  const tind::test::TempDir folder;
  const std::string dem = testdata("bigtujunga_crop.tif"), ply = folder.file("m.ply");
  ASSERT_EQ(
      tind::test::run_tind("simplify " + dem + " --method qem --triangles 200 -o " + ply).code, 0);
  const auto mesh = json_of(ply);
  EXPECT_EQ(mesh["kind"], "mesh");
  EXPECT_EQ(mesh["format"], "ply");
  const auto both = tind::test::run_tind("info " + ply + " " + ply);
  EXPECT_THAT(both.out, testing::HasSubstr("mesh, ply, "));
  EXPECT_THAT(both.out, testing::HasSubstr(" triangles, x y z "));
  EXPECT_THAT(both.out, testing::HasSubstr(", WGS 84 / UTM zone 11N"));
  EXPECT_NEAR(mesh["triangles"].get<double>(), 200, 1);
  EXPECT_LT(mesh["low"][2], mesh["high"][2]);
  const std::string tpm = folder.file("m.tpm");
  ASSERT_EQ(
      tind::test::run_tind("progressive " + dem + " --method qem --max-error 20 -o " + tpm).code,
      0);
  const auto whole = json_of(tpm);
  EXPECT_EQ(whole["kind"], "progressive mesh");
  EXPECT_EQ(whole["complete"], true);
  EXPECT_EQ(whole["vertical_datum"], "unknown");
  std::filesystem::resize_file(tpm, std::filesystem::file_size(tpm) * 3 / 4);
  const auto cut = json_of(tpm);
  EXPECT_EQ(cut["complete"], false);
  EXPECT_GE(cut["max_error_m"], whole["max_error_m"]);
  EXPECT_LT(cut["vertices"], whole["vertices"]);
}

std::size_t lines_of(const std::string& text) { return std::ranges::count(text, '\n'); }

TEST(Info, AnInventoryOfWhateverLiesThere) {
  const tind::test::TempDir folder, empty;
  std::ofstream(folder.file("noise.tif")) << "noise";
  const Ran two = info(testdata("rainier.tif") + " " + testdata("crater.tif"));
  EXPECT_EQ(two.code, 0) << two.out;
  EXPECT_EQ(lines_of(two.out), 2u) << two.out;
  EXPECT_THAT(two.answer,
              testing::AllOf(testing::HasSubstr("GTiff, 577 x 481 posts, 63.62 x 92.64 m"),
                             testing::HasSubstr("datum egm96, 312 .. 4371 m, 1.63 % void"),
                             testing::HasSubstr("no CRS, datum unknown, 1533 .. 2478 m")));
  const std::string all = testdata("rainier.tif") + " " + folder.file("noise.tif") + " " +
                          empty.path().string() + " " + testdata("crater.tif");
  const Ran told = info(all);
  EXPECT_EQ(told.code, 65);
  EXPECT_EQ(lines_of(told.answer), 4u) << told.out;
  EXPECT_THAT(told.answer,
              testing::AllOf(testing::HasSubstr("577 x 481"), testing::HasSubstr("no CRS"),
                             testing::HasSubstr("noise.tif "),
                             testing::HasSubstr(" cannot be read: not a raster"),
                             testing::HasSubstr("folder without layer.json")));
  EXPECT_THAT(told.out, testing::HasSubstr("2 of 4 inputs cannot be read"));
  const auto json = nlohmann::json::parse(info(all + " --json").answer);
  ASSERT_EQ(json.size(), 4u);
  EXPECT_EQ(json[0]["kind"], "dem");
  EXPECT_EQ(json[0]["cols"], 577);
  EXPECT_EQ(json[1]["kind"], "unreadable");
  EXPECT_EQ(json[3]["input"], testdata("crater.tif"));
}

TEST(Info, SaysWhatTheNumbersAre) {
  const auto j = json_of(testdata("rainier.tif") + " --scale 2 --nodata -5");
  EXPECT_EQ(j["content"]["type"], "Int16");
  EXPECT_EQ(j["content"]["band"], 1);
  EXPECT_EQ(j["content"]["scale"], 2);
  const auto nodata = j["content"]["nodata"].get<std::vector<double>>();
  EXPECT_NE(std::ranges::find(nodata, -5), nodata.end());
  EXPECT_THAT(info(testdata("rainier.tif")).out, testing::HasSubstr("numbers    Int16"));
}

TEST(Info, OfSeveralDemsTheLayersThatTheyMake) {
  const tind::test::TempDir dir;
  const auto write = [&](const char* name, double x, double y, double step, const char* wkt) {
    std::ofstream out(dir.file(std::string(name) + ".asc"));
    out << "ncols 9\nnrows 9\nxllcenter " << x << "\nyllcenter " << y << "\ncellsize " << step
        << "\nNODATA_value -9999\n";
    for (int i = 0; i < 81; ++i) out << i << ' ';
    std::ofstream(dir.file(std::string(name) + ".prj")) << wkt;
  };
  const char* degrees =
      R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],)"
      R"(PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
  write("base", 8, 46, 0.125, degrees);
  write("town", 8.5, 46.5, 0.001, degrees);
  write("town2", 8.509, 46.5, 0.001, degrees);
  const std::string files =
      dir.file("town.asc") + " " + dir.file("base.asc") + " " + dir.file("town2.asc");
  const auto j = json_of(files + " --accuracy le90=4");
  ASSERT_EQ(j.size(), 4u);
  const auto& layers = j.back();
  EXPECT_EQ(layers["kind"], "layers");
  ASSERT_EQ(layers["layers"].size(), 2u) << layers.dump();
  EXPECT_EQ(layers["layers"][0]["name"], "base");
  EXPECT_EQ(layers["layers"][1]["files"].size(), 2u);
  EXPECT_EQ(layers["layers"][1]["accuracy"]["m"], 4);
  EXPECT_EQ(layers["layers"][0]["content"]["nodata"][0], -9999);
  const auto table = info(files).out;
  EXPECT_THAT(table, testing::HasSubstr("spacing m"));
  EXPECT_LT(table.rfind("\ntown "), table.rfind("\nbase ")) << table;  // the topmost first
  // What makes no surface is only listed.
  EXPECT_EQ(json_of(files + " " + testdata("crater.tif")).size(), 4u);
}

TEST(Info, AFolderIsOneDemWhereItsRastersShareAGrid) {
  const tind::test::TempDir folder;
  std::filesystem::copy_file(testdata("rainier.tif"), folder.file("a.tif"));
  EXPECT_EQ(json_of(folder.path().string())["cols"], 577);
  std::ofstream(folder.file("list.txt")) << "# one\na.tif\n";
  EXPECT_EQ(json_of("@" + folder.file("list.txt"))["cols"], 577);
  std::filesystem::copy_file(testdata("crater.tif"), folder.file("b.tif"));
  const Ran several = info(folder.path().string());
  EXPECT_EQ(several.code, 0) << several.out;
  EXPECT_EQ(lines_of(several.answer), 2u) << several.out;
  EXPECT_THAT(several.out, testing::HasSubstr("no one DEM"));
}

TEST(Info, LinesAndPolygons) {
  const tind::test::TempDir folder;
  const std::string file = folder.file("lakes.geojson");
  std::ofstream(file) << R"({"type":"FeatureCollection","features":[
    {"type":"Feature","properties":{},"geometry":{"type":"Polygon","coordinates":
      [[[1,2,30],[3,2,30],[3,5,31],[1,2,30]]]}},
    {"type":"Feature","properties":{},"geometry":{"type":"MultiLineString","coordinates":
      [[[0,0],[1,1]],[[2,2],[7,3],[4,4]]]}}]})";
  const auto j = json_of(file);
  EXPECT_EQ(j["kind"], "lines and polygons");
  ASSERT_EQ(j["layers"].size(), 1u);
  const auto& layer = j["layers"][0];
  EXPECT_EQ(layer["polygons"], 1);
  EXPECT_EQ(layer["lines"], 2);
  EXPECT_EQ(layer["vertices"], 9);
  EXPECT_EQ(layer["vertices_with_height"], 4);
  EXPECT_EQ(layer["bounds"], nlohmann::json({0, 0, 7, 5}));
  EXPECT_EQ(layer["heights"], nlohmann::json({30, 31}));
  EXPECT_THAT(layer["crs"].get<std::string>(), testing::HasSubstr("WGS 84"));
  const Ran both = info(file + " " + testdata("rainier.tif"));
  EXPECT_EQ(both.code, 0) << both.out;
  EXPECT_THAT(both.out, testing::HasSubstr("1 polygon, 2 lines, 9 vertices"));
  std::ofstream(folder.file("broken.geojson")) << "{\"type\":";
  EXPECT_EQ(info(folder.file("broken.geojson")).code, 65);
}

TEST(Info, VectorFilesOfMeshFormatsAreDescribed) {
  const tind::test::TempDir folder;
  for (const char* name : {"m.gpkg", "m.fgb"}) {
    const std::string file = folder.file(name);
    ASSERT_EQ(tind::test::run_tind("simplify " + testdata("rainier.tif") +
                                   " --ratio 0.001 --progress none -o " + file)
                  .code,
              0);
    const auto j = json_of(file);
    EXPECT_EQ(j["kind"], "lines and polygons") << name;
    EXPECT_GT(j["layers"][0]["polygons"], 50) << name;
    EXPECT_EQ(j["layers"][0]["vertices_with_height"], j["layers"][0]["vertices"]) << name;
  }
  std::ofstream(folder.file("bad.gpkg")) << "nothing";
  const Ran bad = info(folder.file("bad.gpkg"));
  EXPECT_EQ(bad.code, 65);
  EXPECT_THAT(bad.out, testing::HasSubstr("tind writes meshes like this"));
}

TEST(Info, WhatIsNoRasterIsCalledWhatItIs) {
  const tind::test::TempDir folder;
  std::ofstream(folder.file("a.vrt")) << "<VRTDataset/>";
  const Ran vrt = info(folder.file("a.vrt"));
  EXPECT_EQ(vrt.code, 65);
  EXPECT_THAT(vrt.out, testing::HasSubstr("--allow-vrt"));
  const Ran dir =
      tind::test::run_tind("simplify " + folder.path().string() + " --ratio 0.5 -o a.ply");
  EXPECT_EQ(dir.code, 69);
  EXPECT_THAT(dir.out, testing::HasSubstr("is a folder"));
}

}  // namespace
