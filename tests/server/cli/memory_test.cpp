// tind build --memory: the system's account of the largest memory, on a DEM that needs an index and
// on small ones of all shapes.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
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
  EXPECT_LT(report["index"]["bytes"].get<double>(), 0.2 * 2 * 6000 * 6000);
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

/// An ESRI ASCII grid with its .prj: `corner` is the lower left one, in the CRS's unit.
void write_dem(const std::string& path, const std::string& prj, int cols, int rows, double x,
               double y, double step) {
  std::ofstream(path + ".prj") << prj;
  std::ofstream out(path + ".asc");
  out << std::setprecision(12) << "ncols " << cols << "\nnrows " << rows << "\nxllcorner " << x
      << "\nyllcorner " << y << "\ncellsize " << step << "\n";
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < cols; ++c)
      out << 800 + int(300 * std::sin(c * .11) * std::cos(r * .07) + 40 * std::sin(c * 1.7 + r))
          << (c + 1 < cols ? ' ' : '\n');
}

const std::string kDegrees =
    R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
    R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
const std::string kMetres =
    "PROJCS[\"made up\"," + kDegrees +
    R"(,PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],)"
    R"(PARAMETER["central_meridian",9],PARAMETER["scale_factor",0.9996],)"
    R"(PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["metre",1]])";
const std::string kPolarMetres =
    "PROJCS[\"made up\"," + kDegrees +
    R"(,PROJECTION["Polar_Stereographic"],PARAMETER["latitude_of_origin",70],)"
    R"(PARAMETER["central_meridian",-45],PARAMETER["false_easting",0],)"
    R"(PARAMETER["false_northing",0],UNIT["metre",1]])";

TEST(Memory, that_is_too_little_for_many_layers_is_named) {
  const test::TempDir dir;
  std::string layers;
  for (int k = 0; k < 16; ++k) {
    const std::string name = "l" + std::to_string(k);
    write_dem(dir.file(name), kDegrees, 4, 4, 10 + k, 45, .01 + .001 * k);
    layers += " --layer " + name + "=" + dir.file(name) + ".asc";
  }
  const auto refused = test::run_tind("build" + layers + " --progress none -o " + dir.file("t"));
  EXPECT_EQ(refused.code, 2) << refused.out;
  const auto at = refused.out.find("this source; ");
  ASSERT_NE(at, std::string::npos) << refused.out;
  const std::string enough = refused.out.substr(at + 13, refused.out.find("M is", at) - at - 13);
  EXPECT_LT(std::stoi(enough), 2000) << refused.out;
  EXPECT_EQ(test::run_tind("build" + layers + " --levels 0-1 --progress none --memory " + enough +
                           "M -o " + dir.file("t"))
                .code,
            0);
}

TEST(Memory, a_build_stays_within_it_whatever_the_shape_of_the_dem) {
  if (test::kSanitized) GTEST_SKIP() << "memory under a sanitizer is not the program's";
  const struct {
    std::string name, prj;
    int cols, rows;
    double x, y, step;
  } dems[] = {
      {"small_and_fine", kMetres, 200, 200, 500000, 5000000, 2.5},
      {"small_and_fine_degrees", kDegrees, 160, 120, 7.1, 45.9, 2e-5},
      {"over_a_continent", kDegrees, 200, 200, -20, 0, 0.3},
      {"a_column", kMetres, 2, 4000, 500000, 5000000, 10},
      {"a_row", kDegrees, 4000, 2, 10, 50, 1e-4},
      {"one_post", kMetres, 1, 1, 500000, 5000000, 10},
      {"to_the_pole", kDegrees, 360, 60, -180, 60, 0.5},
      {"at_the_pole", kDegrees, 60, 60, 10, 89.99, 1e-4},
      {"around_the_pole", kPolarMetres, 80, 80, -200, -200, 5},
      {"at_the_antimeridian", kDegrees, 200, 200, 179.998, 10, 2e-5},
  };
  for (const auto& d : dems) {
    const test::TempDir dir;
    write_dem(dir.file(d.name), d.prj, d.cols, d.rows, d.x, d.y, d.step);
    const auto ran = run_tind("build " + dir.file(d.name + ".asc") + " -o " + dir.file("tiles") +
                              " --levels 0-6 --effort fast --memory 210M --json --progress none");
    ASSERT_EQ(ran.code, 0) << d.name << ": " << ran.out;
    EXPECT_LE(Json::parse(ran.answer)["peak_mb"].get<double>(), 210) << d.name;
  }
}

}  // namespace
}  // namespace tind
