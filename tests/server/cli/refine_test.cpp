#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/program.h"
#include "tests/support/program_json.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::run_tind;

TEST(Refine, BothErrorsHoldAndTheRegionIsWhereItShouldBe) {
  test::TempDir dir;
  const std::string dem = test::testdata("rainier.tif"), out = dir.file("a.ply");
  const auto ran = run_tind("refine " + dem + " -o " + out +
                            " --route '-121.9,46.7 -121.7,46.9' --width 2000 --inside 1 "
                            "--outside 80 --json --progress none");
  ASSERT_EQ(ran.code, 0) << ran.out;
  const auto json = nlohmann::json::parse(ran.answer);
  EXPECT_LE(json["inside"]["max_error_m"], 1.0);
  EXPECT_LE(json["outside"]["max_error_m"], 80.0);
  EXPECT_GT(json["outside"]["max_error_m"], 20.0);
  // 27 km of a 2 km corridor and its two half discs, 57 km2, at 63.5 by 92.7 m a post.
  EXPECT_NEAR(double(json["inside"]["posts"]), 57e6 / (92.7 * 63.5), 500);
  const auto box = run_tind("refine " + dem + " -o " + out +
                            " --bbox=-121.8,46.8,-121.75,46.85 --inside 0 --progress none");
  EXPECT_EQ(box.code, 0) << box.out;
  EXPECT_NE(box.out.find("within 0.000 m"), std::string::npos) << box.out;
}

TEST(Refine, StatesTheErrorOfTheFileThatItWrites) {
  test::TempDir dir;
  const std::string dem = test::testdata("rainier.tif");
  for (const char* name : {"a.ply", "a.stl"}) {
    SCOPED_TRACE(name);
    const std::string out = dir.file(name);
    const auto said = test::tind_json("refine " + dem + " -o " + out +
                                      " --bbox=-121.8,46.8,-121.75,46.85 --inside 0 --outside 0 "
                                      "--json --progress none");
    const auto found = test::tind_json("measure " + out + " " + dem + " --json");
    const double inside = said["inside"]["max_error_m"], outside = said["outside"]["max_error_m"];
    EXPECT_NEAR(std::max(inside, outside), found["max_error_m"], 1e-6);
    EXPECT_EQ(inside + outside > 1e-6, std::string(name) == "a.stl");
    EXPECT_EQ(said["note"] != "", std::string(name) == "a.stl") << said["note"];
    EXPECT_EQ(std::uint64_t(said["inside"]["posts_uncovered"]) +
                  std::uint64_t(said["outside"]["posts_uncovered"]),
              found["posts_uncovered"]);
  }
}

TEST(Refine, SaysWhatIsWrong) {
  test::TempDir dir;
  const std::string start = "refine " + test::testdata("rainier.tif") + " -o " + dir.file("a.ply");
  EXPECT_EQ(run_tind(start).code, 2);
  EXPECT_EQ(run_tind(start + " --bbox 1,2,3").code, 2);
  // Beside the DEM, and with its sides exchanged, which is another box altogether.
  const auto refused = [&](const std::string& box, const std::string& word) {
    const auto ran = run_tind(start + " --bbox=" + box);
    EXPECT_EQ(ran.code, 2) << box << "\n" << ran.out;
    EXPECT_NE(ran.out.find(word), std::string::npos) << ran.out;
  };
  refused("1,2,3,4", "outside the DEM");
  refused("-121.75,46,238.15,47", "both ends on the DEM");
  refused("-121.75,46.8,-121.8,46.85", "WEST,SOUTH,EAST,NORTH");
  refused("-121.8,46.85,-121.75,46.8", "WEST,SOUTH,EAST,NORTH");
  EXPECT_EQ(run_tind(start + " --polygon '1,x 2,3 4,5'").code, 2);
  EXPECT_EQ(run_tind(start + " --route '1,2 3,4'").code, 2);
  EXPECT_EQ(run_tind(start + " --bbox 1,2,3,4 --inside 9 --outside 1").code, 2);
}

}  // namespace
}  // namespace tind
