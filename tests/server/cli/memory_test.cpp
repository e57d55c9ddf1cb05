// tind build --memory: the system's account of the largest memory, on a DEM that needs an index.

#include <gtest/gtest.h>

#include <cstdlib>
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

TEST(Memory, a_build_stays_within_it) {
  if (test::kSanitized) GTEST_SKIP() << "memory under a sanitizer is not the program's";
  const test::TempDir dir;
  const std::string script =
      (std::filesystem::path(test::testdata("")) / "../scripts/make_large_dem").string();
  ASSERT_EQ(std::system((script + " " + dir.file("dem") + " --side 6000 >/dev/null").c_str()), 0);
  const std::string build = "build " + dir.file("dem/large.vrt") +
                            " --allow-vrt --levels 0-9 --max-error 150 --effort fast --json "
                            "--progress none -o ";
  const auto ran = run_tind(build + dir.file("tiles") + " --memory 200M --threads 64");
  ASSERT_EQ(ran.code, 0) << ran.out;
  const Json report = Json::parse(ran.answer);
  EXPECT_LE(report["peak_mb"].get<double>(), 200);
  EXPECT_LT(report["threads"].get<int>(), 64);
  EXPECT_TRUE(report["index"]["made"]);
  // The index is small beside 2 bytes a post.
  EXPECT_LT(report["index"]["bytes"].get<double>(), 0.08 * 2 * 6000 * 6000);
  // Rough as the DEM is, every tile that the index is for does with it and reads no posts, and all
  // keep their levels' budgets.
  EXPECT_EQ(report["over_budget"], 0);
  for (int z = 0; z <= report["index"]["deepest_level"]; ++z)
    for (const auto& file :
         std::filesystem::recursive_directory_iterator(dir.file("tiles/" + std::to_string(z)))) {
      if (!file.is_regular_file()) continue;
      std::ifstream in(file.path(), std::ios::binary);
      const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
      const bool empty = bytes.find("\"posts\":0") != std::string::npos;
      EXPECT_TRUE(empty || bytes.find("residual_m") != std::string::npos) << file.path();
    }

  const auto small = run_tind(build + dir.file("none") + " --memory 40M");
  EXPECT_NE(small.code, 0);
  EXPECT_NE(small.out.find("--memory 40M"), std::string::npos) << small.out;
  EXPECT_FALSE(std::filesystem::exists(dir.file("none")));
}

}  // namespace
}  // namespace tind
