// tind info as its users run it: the program, its exit code, its JSON.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "proto/layer_json.h"
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

}  // namespace
