// The program itself: --breaklines, --flatten and --boundary, through every method.

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "terrain/mesh/constrained_delaunay.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/program_json.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::Ran;
using test::run_tind;
using test::TempDir;
using test::testdata;

std::string lines() { return " --breaklines " + testdata("breaklines.geojson"); }
std::string lake() { return " --flatten " + testdata("lake.geojson"); }
std::string boundary() { return " --boundary " + testdata("boundary.geojson"); }

class LineOptions : public testing::Test {
 protected:
  const TempDir dir_;
  const std::string simplify_ =
      "simplify " + testdata("bigtujunga_crop.tif") + " -o " + dir_.file("a.ply") + " --ratio 0.08";
};

TEST_F(LineOptions, HoldThroughEveryMethod) {
  if (!has_constrained_delaunay()) GTEST_SKIP() << "built without CGAL";
  for (const MethodInfo& method : methods()) {
    SCOPED_TRACE(method.name);
    const auto made = test::tind_json(simplify_ + lines() + lake() + boundary() +
                                      " --json --progress none --method " + method.name);
    EXPECT_EQ(made["flipped"], 0);
    EXPECT_EQ(made["uncovered"], 0);
    const auto& l = made["lines"];
    EXPECT_GT(l["parts"], 40);
    EXPECT_EQ(l["parts_missing"], 0);
    EXPECT_EQ(l["triangles_not_level"], 0);
    EXPECT_EQ(l["breaklines"], 6);
    EXPECT_EQ(l["without_length"], 1);
    EXPECT_GE(l["outside"], 1);
    EXPECT_GE(l["crossings"], 2);
    EXPECT_GE(l["overlaps"], 6);
    EXPECT_GT(l["posts_flattened"], 500);
    EXPECT_GT(l["posts_outside"], 8000);
    EXPECT_GT(made["peak_mb"], 1);
  }
}

TEST_F(LineOptions, AreRefusedInOneLine) {
  const auto refuses = [&](const std::string& more, int code, const std::string& word) {
    const Ran ran = run_tind(simplify_ + more);
    EXPECT_EQ(ran.code, code) << ran.out;
    EXPECT_NE(ran.out.find(word), std::string::npos) << ran.out;
    EXPECT_EQ(std::count(ran.out.begin(), ran.out.end(), '\n'), 1) << ran.out;
  };
  if (!has_constrained_delaunay()) {
    refuses(lines(), 65, "TIND_WITH_CGAL");
    return;
  }
  refuses(" --breaklines " + dir_.file("none.geojson"), 69, "none.geojson");
  std::ofstream(dir_.file("text.geojson")) << "no vectors";
  refuses(" --breaklines " + dir_.file("text.geojson"), 65, "text.geojson");
  refuses(" --flatten " + testdata("breaklines.geojson"), 65, "polygons are needed");
  refuses(lines() + " --method bounded --side above", 2, "--side is both");
}

}  // namespace
}  // namespace tind
