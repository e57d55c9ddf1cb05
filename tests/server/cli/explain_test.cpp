// tind explain against what is known of a tile otherwise: its own metadata and the posts of
// its DEM.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tests/support/program.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using Json = nlohmann::json;
using test::run_tind;

class ExplainTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TempDir;
    const auto ran =
        run_tind("build " + dem() + " -o " + tiles() + " --max-error 10 --progress none");
    ASSERT_EQ(ran.code, 0) << ran.out;
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static std::string dem() { return test::testdata("rainier.tif"); }
  static std::string tiles() { return folder_->file("tiles"); }
  static Json explain(const std::string& tile, const std::string& more = "") {
    const auto ran =
        run_tind("explain " + tiles() + " " + tile + " --json --progress none " + more);
    EXPECT_EQ(ran.code, 0) << ran.out;
    return ran.code == 0 ? Json::parse(ran.answer) : Json();
  }
  static test::TempDir* folder_;
};
test::TempDir* ExplainTest::folder_ = nullptr;

constexpr const char* kLeaf = "12/1323/3113";  // around the summit

TEST_F(ExplainTest, ErrorsArePostsErrors) {
  const Json j = explain(kLeaf, "--source " + dem());
  ASSERT_TRUE(j.contains("source"));
  const Json& s = j["source"];
  EXPECT_NEAR(s["max_error_m"].get<double>(), j["stated_max_error_m"].get<double>(), 0.01);
  EXPECT_LE(s["max_error_m"].get<double>(), j["stated_max_error_m"].get<double>());
  EXPECT_DOUBLE_EQ(std::abs(s["worst"]["mesh_minus_post_m"].get<double>()),
                   s["max_error_m"].get<double>());
  EXPECT_LE(s["rms_error_m"].get<double>(), s["max_error_m"].get<double>());
  EXPECT_GE(s["rms_error_m"].get<double>(), s["mean_error_m"].get<double>());
  std::uint64_t sum = 0;
  for (const auto& n : s["histogram"]["posts"]) sum += n.get<std::uint64_t>();
  EXPECT_EQ(sum, s["posts"].get<std::uint64_t>());
  ASSERT_EQ(s["files"].size(), 1u);
  EXPECT_EQ(s["files"][0]["posts"], s["posts"]);
  // The post that is called the worst is where it is said to be.
  const auto info = run_tind("info " + dem() + " --json");
  EXPECT_NEAR(s["worst"]["lon"].get<double>(), -121.98 + s["worst"]["col"].get<int>() / 1200.0,
              1e-9);
  EXPECT_NEAR(s["worst"]["lat"].get<double>(), 47 - s["worst"]["row"].get<int>() / 1200.0, 1e-9);
}

TEST_F(ExplainTest, VerticesAddUp) {
  const Json j = explain(kLeaf, "--source " + dem());
  const Json& v = j["vertices"];
  EXPECT_EQ(v["edges"].get<int>() + v["lattice"].get<int>() + v["free"].get<int>(),
            v["all"].get<int>());
  int sum = 0, last = -1;
  for (const Json& l : j["vertices_by_level"]) {
    EXPECT_GT(l["level"].get<int>(), last);
    last = l["level"];
    sum += l["vertices"].get<int>();
  }
  EXPECT_EQ(last, 12);
  EXPECT_EQ(sum, v["all"].get<int>());
}

TEST_F(ExplainTest, WhatBinds) {
  EXPECT_EQ(explain(kLeaf)["limited_by"], "max-error");
  EXPECT_DOUBLE_EQ(explain(kLeaf)["budget_m"], 10);
  EXPECT_EQ(explain("11/661/1556", "--source " + dem())["limited_by"], "level");
  EXPECT_EQ(explain("0/0/0", "--source " + dem())["limited_by"], "cap");
  const Json empty = explain("0/1/0", "--source " + dem());
  EXPECT_EQ(empty["limited_by"], "curvature");  // the other hemisphere
  EXPECT_EQ(empty["source"]["posts"], 0);
  EXPECT_EQ(empty["source"]["filled_share"], 1);
}

TEST_F(ExplainTest, ThePictureIsAPng) {
  const std::string png = folder_->file("tile.png");
  explain(kLeaf, "--source " + dem() + " --png " + png);
  std::ifstream in(png, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  ASSERT_GT(bytes.size(), 10000u);
  EXPECT_EQ(bytes.substr(1, 3), "PNG");
  EXPECT_EQ(std::uint8_t(bytes[22]) * 256 + std::uint8_t(bytes[23]), 1024);  // rows
  // True to scale: cos(46.8 degrees) as wide as high.
  EXPECT_NEAR(std::uint8_t(bytes[18]) * 256 + std::uint8_t(bytes[19]), 703, 5);
}

TEST_F(ExplainTest, WhatAServerSaysOfItselfCanBeAnything) {
  const std::string leaf = folder_->file("odd") + "/" + kLeaf + ".terrain";
  std::filesystem::create_directories(std::filesystem::path(leaf).parent_path());
  std::filesystem::copy_file(tiles() + "/" + kLeaf + ".terrain", leaf);
  std::ofstream(folder_->file("odd/layer.json")) << R"({"maxzoom": 12, "tiles": ["{z}/{x}/{y}"]})";
  std::ofstream(folder_->file("odd/tind-build.json"))
      << R"({"max_error_m": "10", "error_factor": [], "deepest_level": 1e99, "side": 7})";
  EXPECT_EQ(run_tind("explain " + folder_->file("odd") + " " + kLeaf + " --progress none").code, 0);
}

TEST_F(ExplainTest, WhatIsNotThereIsSaid) {
  EXPECT_EQ(run_tind("explain " + tiles() + " 12/0/0").code, 69);
  EXPECT_EQ(run_tind("explain " + tiles() + " 12/9999999/0").code, 2);
  EXPECT_EQ(run_tind("explain " + tiles() + " 1/2").code, 2);
  EXPECT_EQ(run_tind("explain /no/such/folder 0/0/0").code, 69);
}

}  // namespace
}  // namespace tind
