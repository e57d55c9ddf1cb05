// What tind estimate says beforehand against what tind build then makes.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/program.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using Json = nlohmann::json;
using test::run_tind;

Json output_of(const std::string& arguments) {
  const auto ran = run_tind(arguments + " --json --progress none");
  EXPECT_EQ(ran.code, 0) << ran.out;
  return ran.code == 0 ? Json::parse(ran.answer) : Json();
}

void expect_close(const std::string& dem, const std::string& options) {
  const test::TempDir folder;
  const Json said = output_of("estimate " + dem + " " + options);
  const Json made = output_of("build " + dem + " -o " + folder.file("tiles") + " " + options);
  EXPECT_EQ(said["tiles"], made["tiles"]);
  EXPECT_LT(said["sampled"].get<int>(), said["tiles"].get<int>());
  const double bytes = made["bytes"].get<double>();
  EXPECT_NEAR(said["bytes"].get<double>(), bytes, 0.25 * bytes);
  ASSERT_EQ(said["levels"].size(), made["levels"].size());
  for (std::size_t i = 0; i < said["levels"].size(); ++i) {
    const Json &a = said["levels"][i], &b = made["levels"][i];
    EXPECT_EQ(a["tiles"], b["tiles"]);
    if (a["sampled"] == a["tiles"]) {
      EXPECT_DOUBLE_EQ(a["bytes"].get<double>(), b["bytes"].get<double>()) << a["level"];
    }
  }
}

TEST(Estimate, SmallShardsTakeSomeTime) {
  const auto said =
      run_tind("estimate " + test::testdata("rainier.tif") + " --shards 60 --progress none");
  ASSERT_EQ(said.code, 0) << said.out;
  EXPECT_NE(said.out.find("60 shards of about "), std::string::npos) << said.out;
  EXPECT_EQ(said.out.find("about 0 s"), std::string::npos) << said.out;
}

TEST(Estimate, BytesAndCountsAreWhatTheBuildMakes) {
  expect_close(test::testdata("rainier.tif"), "--max-error 10");
}

TEST(Estimate, CompressedToo) {
  expect_close(test::testdata("rainier.tif"), "--max-error 40 --gzip");
}

TEST(Estimate, ADryRunSaysTheSameAndWritesNothing) {
  const test::TempDir folder;
  const std::string what = test::testdata("bigtujunga_crop.tif") + " --max-error 20";
  const Json dry = output_of("build " + what + " --dry-run -o " + folder.file("tiles"));
  const Json said = output_of("estimate " + what);
  EXPECT_EQ(dry["bytes"], said["bytes"]);
  EXPECT_EQ(dry["levels"].size(), said["levels"].size());
  EXPECT_FALSE(std::filesystem::exists(folder.file("tiles")));
  EXPECT_EQ(run_tind("build " + what).code, 2);  // without --dry-run it has to know where
}

}  // namespace
}  // namespace tind
