// --layer, --blend, --layer-error as users give them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "terrain/mesh/constrained_delaunay.h"
#include "tests/support/program.h"
#include "tests/support/support.h"

namespace tind::cli {
namespace {

using test::Ran;
using test::run_tind;
using test::testdata;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string estimate(const std::string& options) {
  return "build " + testdata("rainier.tif") + " --dry-run --levels 0-6 -o none --progress none" +
         options;
}

TEST(SurfaceInput, ABlendThatIsNoneSaysWhy) {
  for (const auto& [said, why] :
       {std::pair("-4", "--blend -4: -4 is negative"), std::pair("nan", "not finite"),
        std::pair("inf", "not finite"), std::pair("1e999", "not finite"),
        std::pair("lam=1e9", "--blend lam=1e9: 1e9 is too large: at most 10000000 m"),
        std::pair("wide", "takes METRES, or NAME=METRES"), std::pair("4m", "takes METRES")}) {
    const Ran ran = run_tind(estimate(std::string(" --blend=") + said));
    EXPECT_EQ(ran.code, 2) << said;
    EXPECT_THAT(ran.out, HasSubstr(why));
  }
  EXPECT_THAT(run_tind(estimate(" --layer-error rainier=-1")).out,
              HasSubstr("--layer-error rainier=-1: -1 is negative"));
}

TEST(SurfaceInput, ABlendOfOneDemIsDoubted) {
  const Ran with = run_tind(estimate(" --blend 20"));
  EXPECT_EQ(with.code, 0) << with.out;
  EXPECT_THAT(with.out, AllOf(HasSubstr("warning: --blend"), HasSubstr("only one layer")));
  EXPECT_THAT(run_tind(estimate("")).out, Not(HasSubstr("--blend")));
}

/// A slope of posts, `side` x `side`, from 7 east and 46 north.
std::string slope(const test::TempDir& dir, const std::string& name, int side, double step) {
  const std::string file = dir.file(name + ".asc");
  std::ofstream out(file);
  out << "ncols " << side << "\nnrows " << side << "\nxllcenter 7\nyllcenter 46\ncellsize " << step
      << "\n";
  for (int i = 0; i < side * side; ++i) out << i % side * step * 5000 << ' ';
  std::ofstream(dir.file(name + ".prj"))
      << "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],"
         "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]";
  return file;
}

TEST(SurfaceInput, ACheckWithOtherOptionsThanTheBuildsSaysWhich) {
  const test::TempDir dir;
  const std::string layers = slope(dir, "base", 40, 0.01) + " " + slope(dir, "fine", 60, 0.002);
  const std::string tiles = dir.file("tiles"), quiet = " --progress none";
  const Ran built = run_tind("build " + layers + " --blend 900 -o " + tiles + quiet);
  ASSERT_EQ(built.code, 0) << built.out;
  const std::string check = "check " + tiles + quiet + " --source " + layers;
  EXPECT_THAT(run_tind(check + " --blend 900").out, Not(HasSubstr("note:")));
  const char* const said = "a blend of fine of 900 m, not 2500 m";
  EXPECT_THAT(run_tind(check + " --blend 2500").out,
              AllOf(HasSubstr("note: the tiles were made of another source"), HasSubstr(said)));
  const Ran json = run_tind(check + " --blend 2500 --json");
  EXPECT_THAT(json.answer, AllOf(HasSubstr("\"source_note\""), HasSubstr(said)));
  EXPECT_THAT(run_tind("check " + tiles + quiet + " --source " + dir.file("base.asc")).out,
              HasSubstr("2 layers, not 1"));
  const Ran update = run_tind("build " + layers + " --blend 2500 -o " + tiles + quiet);
  EXPECT_EQ(update.code, 0) << update.out;
  EXPECT_THAT(update.out, AllOf(HasSubstr("blend"), Not(HasSubstr("gone, or on another grid"))));
}

TEST(SurfaceInput, ALakeAboveAnotherDatumThanTheTilesIsRefused) {
  if (!has_constrained_delaunay()) GTEST_SKIP() << "built without CGAL";
  const test::TempDir dir;
  const std::string lake = dir.file("lake.geojson");
  std::ofstream(lake)
      << R"({"type":"FeatureCollection","crs":{"type":"name","properties":{"name":)"
      << R"("EPSG:4326+5773"}},"features":[{"type":"Feature","properties":{},"geometry":{"type":)"
      << R"("Polygon","coordinates":[[[7.1,46.1,700],[7.2,46.1,700],[7.2,46.2,700],[7.1,46.1,700]]]}}]})";
  const std::string tiles = dir.file("tiles");
  const std::string build = "build " + slope(dir, "base", 40, 0.01) +
                            " --from-datum egm96 --levels 0-9 --progress none -o " + tiles +
                            " --flatten " + lake;
  const Ran above_ellipsoid = run_tind(build);
  EXPECT_EQ(above_ellipsoid.code, 2);
  EXPECT_THAT(above_ellipsoid.out,
              HasSubstr("lake.geojson: says that its heights are above 'EGM96 height', and those "
                        "of the DEM, once converted, are above ellipsoid"));
  const Ran of_dem = run_tind(build + " --line-heights dem");
  EXPECT_EQ(of_dem.code, 0) << of_dem.out;
  const Ran above_egm96 = run_tind(build + " --to-datum egm96 --force");
  EXPECT_EQ(above_egm96.code, 0) << above_egm96.out;
  EXPECT_THAT(run_tind("elevation --tiles " + tiles + " --level 9 --at 7.18,46.12").out,
              HasSubstr("700.000 m above egm96"));
  // Where the DEM's is unknown.
  EXPECT_THAT(run_tind("build " + dir.file("base.asc") + " --dry-run --levels 0-6 -o none" +
                       " --progress none --flatten " + lake)
                  .out,
              HasSubstr("lake.geojson are above 'EGM96 height', and of"));
}

}  // namespace
}  // namespace tind::cli
