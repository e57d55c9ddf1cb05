// Shards as engines run them: with their variables, two copies at once, signals, make.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>

#include "terrain/base/file_io.h"
#include "tests/support/program_json.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Shards : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = std::make_unique<test::TempDir>();
    const std::string tiles = shared_->file("tiles");
    ASSERT_EQ(test::run_tind("build " + dem() + kOptions + " -o " + tiles).code, 0);
    ASSERT_EQ(test::run_tind("copy " + tiles + " " + shared_->file("all.pmtiles")).code, 0);
  }
  static void TearDownTestSuite() { shared_.reset(); }

  static constexpr const char* kOptions = " --deepest 11 --effort fast";
  static std::string dem() { return test::testdata("rainier.tif"); }
  std::string file(const std::string& name) const { return folder_.file(name); }
  std::string plan() const { return file("PLAN.json"); }
  void make_plan(int shards) const {
    const auto said = test::run_tind("plan-build " + dem() + kOptions + " -o " + plan() +
                                     " --shards " + std::to_string(shards));
    ASSERT_EQ(said.code, 0) << said.out;
  }
  test::Ran build(const std::string& shard, const std::string& before = {}) const {
    return test::run_tind(
        "build --plan " + plan() + " --threads 1 --progress none --shard " + shard, before);
  }
  void expect_merged() const {
    const auto merged = test::run_tind("merge --plan " + plan() + " -o " + file("m.pmtiles"));
    ASSERT_EQ(merged.code, 0) << merged.out;
    EXPECT_TRUE(read_whole_file(file("m.pmtiles")).value_or("") ==
                *read_whole_file(shared_->file("all.pmtiles")));
  }

  inline static std::unique_ptr<test::TempDir> shared_;
  test::TempDir folder_;
};

TEST_F(Shards, AreWhatTheEngineSays) {
  make_plan(6);
  EXPECT_EQ(test::run_tind("status --plan " + plan()).code, 75);
  const char* const engines[] = {"JOB_COMPLETION_INDEX=4", "SLURM_ARRAY_TASK_ID=2",
                                 "AWS_BATCH_JOB_ARRAY_INDEX=0", "PARALLEL_SEQ=6",
                                 "OMPI_COMM_WORLD_RANK=1 OMPI_COMM_WORLD_SIZE=4"};
  for (const char* engine : engines) {
    const auto made = build("auto", engine);
    EXPECT_EQ(made.code, 0) << made.out;
  }
  const auto merged = test::run_tind("merge --plan " + plan() + " -o " + file("m.pmtiles"));
  EXPECT_EQ(merged.code, 75);
  EXPECT_THAT(merged.out, HasSubstr("1 of 6 shards are not there: 3;"));
  const auto status = nlohmann::json::parse(test::run_tind("status --json --plan " + plan()).answer,
                                            nullptr, false);
  EXPECT_EQ(status["done"], 5);
  EXPECT_EQ(status["not_done"][0]["shard"], 3);
  EXPECT_EQ(build("3/6").code, 0);
  EXPECT_EQ(test::run_tind("status --every-byte --plan " + plan()).code, 0);
  const std::string with_output = "status --plan " + plan() + " -o " + file("m.pmtiles");
  EXPECT_EQ(test::run_tind(with_output).code, 75) << "all shards, and no merge";
  expect_merged();
  EXPECT_EQ(test::run_tind(with_output).code, 0);
}

TEST_F(Shards, TwoCopiesAtOnceAreOne) {
  make_plan(1);
  const std::string one = test::tind_binary() + " build --plan " + plan() +
                          " --threads 1 --progress none --shard 0/1 >/dev/null 2>&1";
  const std::string both = one + " & " + one + "; a=$?; wait $!; exit $((a + $?))";
  EXPECT_EQ(std::system(both.c_str()), 0);
  EXPECT_EQ(test::run_tind("status --every-byte --plan " + plan()).code, 0);
  expect_merged();
  std::size_t files = 0;  // whose they are; 00000 and top, each with its record
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(file("shards"))) ++files;
  EXPECT_EQ(files, 5u);
}

TEST_F(Shards, ASignalEndsWith75AndTheNextRunGoesOn) {
  const std::string big = file("big.json");
  ASSERT_EQ(test::run_tind("plan-build " + dem() + " --shards 1 -o " + big).code, 0);
  // As soon as there are some tiles.
  const std::string script =
      test::tind_binary() + " build --plan " + big +
      " --shard 0/1 --threads 1 --progress none >/dev/null 2>&1 & p=$!; until [ $(stat -c %s " +
      file("shards/00000.tiles") +
      " 2>/dev/null || echo 0) -gt 9999 ]; do kill -0 $p || exit 9; done; "
      "kill -TERM $p; wait $p; [ $? = 75 ]";
  ASSERT_EQ(std::system(("bash -c '" + script + "'").c_str()), 0);
  EXPECT_FALSE(fs::exists(file("shards/00000.pmtiles")));
  const auto goes_on =
      test::tind_json("build --plan " + big + " --shard 0/1 --json --progress none");
  EXPECT_GT(goes_on["kept"], 0);
  EXPECT_LT(goes_on["made"], goes_on["tiles"]);
}

TEST_F(Shards, AreTargetsOfMake) {
  make_plan(5);
  const std::string makefile = fs::path(test::testdata("rainier.tif")).parent_path().parent_path() /
                               "scripts/engines/Makefile";
  const std::string make = "make -s -j3 -f " + makefile + " TIND=" + test::tind_binary() +
                           " PLAN=" + plan() + " OUT=" + file("m.pmtiles") + " >" + file("log") +
                           " 2>&1";
  ASSERT_EQ(std::system(make.c_str()), 0) << read_whole_file(file("log")).value_or("");
  expect_merged();
}

/// What is planned of several sources, lines and water is opened again by every shard.
TEST_F(Shards, OfLayersLinesAndWaterAreTheBuild) {
  const auto data = [](const std::string& name) { return test::testdata(name); };
  const std::string mountains = data("bigtujunga_crop.tif"), lake = data("lake.geojson");
  const std::string shapes = " --breaklines " + data("breaklines.geojson") + " --flatten " + lake +
                             " --water " + lake + " --boundary " + data("boundary.geojson");
  const std::string worlds[] = {mountains + shapes + " --deepest 12 --effort fast",
                                "--layer low=" + mountains + " --layer high=" + dem() + shapes +
                                    " --blend 500 --layer-error low=20 --deepest 10 --effort fast"};
  for (const std::string& world : worlds) {
    const test::TempDir one;
    ASSERT_EQ(test::run_tind("build " + world + " -o " + one.file("tiles")).code, 0) << world;
    ASSERT_EQ(test::run_tind("copy " + one.file("tiles") + " " + one.file("all.pmtiles")).code, 0);
    const std::string plan = one.file("PLAN.json");
    const auto planned = test::run_tind("plan-build " + world + " --tiles-per-shard 6 -o " + plan);
    ASSERT_EQ(planned.code, 0) << planned.out;
    const int shards = nlohmann::json::parse(test::run_tind("status --json --plan " + plan).answer,
                                             nullptr, false)["shards"];
    ASSERT_GT(shards, 1) << world;
    for (int i = shards; i-- > 0;) {
      const auto made =
          test::run_tind("build --plan " + plan + " --progress none --shard " + std::to_string(i));
      ASSERT_EQ(made.code, 0) << made.out;
    }
    const auto merged = test::run_tind("merge --plan " + plan + " -o " + one.file("m.pmtiles"));
    ASSERT_EQ(merged.code, 0) << merged.out;
    EXPECT_TRUE(read_whole_file(one.file("m.pmtiles")).value_or("") ==
                *read_whole_file(one.file("all.pmtiles")))
        << world;
  }
}

/// Another machine may have layers and lines elsewhere, too.
TEST_F(Shards, LayersAndLinesMayBeElsewhere) {
  const std::string here = file("a.tif"), there = file("b.tif"), lake = file("lake.geojson"),
                    pond = file("pond.geojson");
  fs::copy_file(test::testdata("bigtujunga_crop.tif"), here);
  fs::copy_file(test::testdata("lake.geojson"), lake);
  ASSERT_EQ(test::run_tind("plan-build --layer low=" + here + " --water " + lake +
                           " --deepest 12 --shards 2 -o " + plan())
                .code,
            0);
  fs::rename(here, there);
  fs::rename(lake, pond);
  EXPECT_EQ(build("0").code, 69);
  const auto status = nlohmann::json::parse(test::run_tind("status --json --plan " + plan()).answer,
                                            nullptr, false);
  EXPECT_EQ(status["failed"], 1) << "why it failed is there for status";
  EXPECT_THAT(std::string(status["not_done"][0]["why"]), HasSubstr("a.tif"));
  const std::string elsewhere = " --layer low=" + there + " --water " + pond;
  for (const char* shard : {"0", "1"}) EXPECT_EQ(build(shard + elsewhere).code, 0);
  EXPECT_EQ(build("top --layer low=" + there + " --flatten " + pond).code, 2) << "none is planned";
  const auto merged =
      test::run_tind("merge --plan " + plan() + elsewhere + " -o " + file("deep/er/m.pmtiles"));
  EXPECT_EQ(merged.code, 0) << merged.out;
}

TEST_F(Shards, OfTwoPlansDoNotShareAFolder) {
  make_plan(2);
  ASSERT_EQ(build("0").code, 0);
  const std::string other = file("other.json");
  const auto planned =
      test::run_tind("plan-build " + dem() + " --deepest 10 --shards 2 -o " + other);
  EXPECT_EQ(planned.code, 0);
  EXPECT_THAT(planned.out, HasSubstr("has shards of another plan"));
  const std::string line = "build --progress none --shard 0 --plan " + other;
  EXPECT_EQ(test::run_tind(line).code, 65);
  EXPECT_EQ(test::run_tind("status --plan " + other).code, 65);
  EXPECT_EQ(test::run_tind("merge --plan " + other + " -o " + file("t")).code, 65);
  EXPECT_EQ(test::run_tind(line + " -o " + file("elsewhere")).code, 0);
  const auto there = build("0");
  EXPECT_THAT(there.out, HasSubstr("there")) << "the first plan's shard is as it was";
  // In its place nobody could merge what is done.
  const std::string again = "plan-build " + dem() + " --deepest 10 --shards 2 -o " + plan();
  const auto refused = test::run_tind(again);
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.out, HasSubstr("--force"));
  EXPECT_EQ(test::run_tind("status --plan " + plan()).code, 75) << "it is as it was";
  EXPECT_EQ(test::run_tind(again + " --force").code, 0);
}

TEST_F(Shards, AFolderThatIsNotThereIsNotOneWithoutShards) {
  make_plan(2);
  for (const char* shard : {"0", "1"}) ASSERT_EQ(build(shard).code, 0);
  const std::string status = "status --plan " + plan() + " --shards ";
  EXPECT_EQ(test::run_tind(status + file("")).code, 0);
  EXPECT_EQ(test::run_tind(status + file("shards")).code, 0) << "the folder itself";
  EXPECT_EQ(test::run_tind(status + file("nowhere")).code, 69);
  EXPECT_EQ(
      test::run_tind("merge --plan " + plan() + " --shards " + file("nowhere") + " -o " + file("t"))
          .code,
      69);
}

TEST_F(Shards, APlanReplacesNothingElse) {
  std::ofstream(file("keep.json")) << "{\"type\": \"FeatureCollection\", \"features\": []}";
  const std::string line = "plan-build " + dem() + kOptions + " --shards 2 -o ";
  const auto said = test::run_tind(line + file("keep.json"));
  EXPECT_EQ(said.code, 2);
  EXPECT_THAT(said.out, HasSubstr("is no plan"));
  EXPECT_THAT(*read_whole_file(file("keep.json")), HasSubstr("FeatureCollection"));
  EXPECT_EQ(test::run_tind(line + file("new/folder/p.json")).code, 0);
  EXPECT_EQ(test::run_tind(line + file("new/folder/p.json")).code, 0) << "a plan is replaced";
  // Of a name that cannot be looked at nobody knows what is there.
  fs::create_symlink(file("round.json"), file("round.json"));
  EXPECT_EQ(test::run_tind(line + file("round.json")).code, 74);
  EXPECT_TRUE(fs::is_symlink(file("round.json")));
}

TEST_F(Shards, APlanSweepsWhatAKilledOneLeft) {
  const std::string left = plan() + ".partial-0123456789abcdef";
  std::ofstream(left) << "{\n";
  make_plan(2);
  EXPECT_TRUE(fs::exists(left)) << "somebody writes it";
  fs::last_write_time(left, fs::file_time_type::clock::now() - std::chrono::hours(2));
  make_plan(2);
  EXPECT_FALSE(fs::exists(left));
}

TEST_F(Shards, AreNotMergedInALevelOfAnotherTileSet) {
  make_plan(2);
  fs::create_directory(file("t"));
  std::ofstream(file("t/tind-tiles.ledger")) << "of its tiles";
  const auto merged = test::run_tind("merge --plan " + plan() + " -o " + file("t/3/new"));
  EXPECT_EQ(merged.code, 2) << merged.out;
  EXPECT_THAT(merged.out, HasSubstr("the folder of a tile set"));
  EXPECT_FALSE(fs::exists(file("t/3/new")));
}

TEST_F(Shards, StatusIsAskedWhetherAllIsThere) {
  make_plan(2);
  for (const char* shard : {"0", "1"}) ASSERT_EQ(build(shard).code, 0);
  const std::string tiles = file("t"), status = "status --plan " + plan() + " -o " + tiles;
  ASSERT_EQ(test::run_tind("merge --plan " + plan() + " -o " + tiles).code, 0);
  EXPECT_EQ(test::run_tind(status + " --every-byte").code, 0);
  std::vector<fs::path> all;
  for (const auto& entry : fs::recursive_directory_iterator(tiles))
    if (entry.path().extension() == ".terrain") all.push_back(entry.path());
  std::ofstream(all.front(), std::ios::app) << "x";
  EXPECT_EQ(test::run_tind(status + " --every-byte").code, 75);
  fs::remove(all.front());
  const auto said = test::run_tind(status);
  EXPECT_EQ(said.code, 75) << said.out;
  EXPECT_THAT(said.out, HasSubstr("not all of it"));
  std::ofstream(file("shards/top.pmtiles"), std::ios::app) << "x";
  EXPECT_EQ(test::run_tind("status --plan " + plan()).code, 65);
  const auto top = nlohmann::json::parse(test::run_tind("status --json --plan " + plan()).answer,
                                         nullptr, false);
  EXPECT_THAT(std::string(top["top_why"]), HasSubstr("top.pmtiles"));
}

TEST_F(Shards, WhatCannotBeReadIsNotTakenForDamagedOrMissing) {
  make_plan(2);
  for (const char* shard : {"0", "1"}) ASSERT_EQ(build(shard).code, 0);
  const std::string tiles = file("t"), status = "status --plan " + plan();
  ASSERT_EQ(test::run_tind("merge --plan " + plan() + " -o " + tiles).code, 0);
  const auto unread = [](const fs::path& path) {
    fs::rename(path, path.string() + ".aside");
    fs::create_symlink(path.filename(), path);  // a loop, which nobody can open
  };
  const auto back = [](const fs::path& path) { fs::rename(path.string() + ".aside", path); };
  unread(file("shards/00001.json"));
  EXPECT_EQ(test::run_tind(status).code, 74);
  back(file("shards/00001.json"));
  unread(tiles + "/tind-build.json");
  EXPECT_EQ(test::run_tind(status + " -o " + tiles).code, 74);
  back(tiles + "/tind-build.json");
  EXPECT_EQ(test::run_tind(status + " -o " + tiles).code, 0);
}

TEST_F(Shards, BadLinesAreRefused) {
  make_plan(2);
  const std::string with = "build --plan " + plan() + " ";
  EXPECT_EQ(test::run_tind(with).code, 2);
  EXPECT_EQ(test::run_tind(with + "--shard 2/2").code, 2);
  EXPECT_EQ(test::run_tind(with + "--shard 0/3").code, 2);
  for (const std::string decided : {"--max-error 3", "--gzip", "--from-datum egm96", "--levels 3"})
    EXPECT_EQ(test::run_tind(with + "--shard 0 " + decided).code, 2) << decided;
  EXPECT_EQ(test::run_tind("build " + dem() + " -o " + file("t") + " --shard 0/2").code, 2);
  EXPECT_EQ(test::run_tind(with + "--shard 0 " + test::testdata("bigtujunga_crop.tif")).code, 2);
  EXPECT_EQ(test::run_tind("plan-build " + dem() + " -o " + file("p")).code, 2);
  EXPECT_EQ(
      test::run_tind("plan-build " + dem() + " --shards 2 --tiles-per-shard 9 -o " + file("p"))
          .code,
      2);
  EXPECT_EQ(test::run_tind("plan-build " + dem() + " --shards 0 -o " + file("p")).code, 2);
  std::ofstream(file("bad.json")) << "{\"tind_plan\": 1}";
  EXPECT_EQ(test::run_tind("status --plan " + file("bad.json")).code, 65);
  EXPECT_EQ(test::run_tind("status --plan " + file("none.json")).code, 69);
}

}  // namespace
}  // namespace tind
