#include "terrain/progressive/stream/make_progressive.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/progressive/stream/progressive_cursor.h"
#include "terrain/progressive/stream/progressive_stream.h"
#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/simplify/common/terrain_mesh.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/support.h"
#include "tests/terrain/progressive/expand.h"

namespace tind {
namespace {

bool on_lattice(const Vec3& p, const Lattice& l) { return l.snap(p) == p; }

struct Case {
  const char* method;
  StopAt fine;
  bool voids;
};

std::string name_of(const testing::TestParamInfo<Case>& c) {
  std::string n = c.param.method;
  std::erase(n, '-');
  return n + (c.param.fine.max_error_m ? "ToAnError" : "FullGrid") + (c.param.voids ? "Voids" : "");
}

class EveryMethod : public testing::TestWithParam<Case> {
 protected:
  HeightGrid grid_ = test::rough_terrain(41, 37, 5, 90);
  Lattice lattice_{4, 0.25};

  void SetUp() override {
    if (!GetParam().voids) return;
    for (int r = 10; r < 16; ++r)
      for (int c = 20; c < 29 - (r & 3); ++c) grid_.at(c, r) = HeightGrid::kVoid;
    grid_.at(5, 30) = grid_.at(0, 12) = HeightGrid::kVoid;
  }
  ProgressiveMesh make() {
    SimplifyOptions o;
    o.method = *method_named(GetParam().method);
    o.stop = GetParam().fine;
    const auto pm = make_progressive({grid_, 30, 25}, o, 24, {}, lattice_);
    EXPECT_TRUE(pm) << pm.error().what;
    return pm ? *pm : ProgressiveMesh{};
  }
};

TEST_P(EveryMethod, EveryPrefixIsAValidMeshWithinItsError) {
  const ProgressiveMesh pm = make();
  ASSERT_GT(pm.splits.size(), 100u);
  const std::uint64_t uncovered =
      vertical_error(test::expand(pm, pm.splits.size()), grid_).uncovered;
  EXPECT_TRUE(GetParam().voids || uncovered == 0);
  Tin mesh = pm.base;
  for (std::size_t i = 0;; ++i) {
    const double bound = i < pm.splits.size() ? double(pm.splits[i].error_m) : pm.fine_error_m;
    const MeshValidity valid = check_validity(mesh);
    ASSERT_TRUE(valid.ok()) << "before split " << i << ": " << valid.first_problem;
    const VerticalError error = vertical_error(mesh, grid_);
    ASSERT_LE(error.max_m, bound) << "before split " << i;
    ASSERT_EQ(error.uncovered, uncovered) << "before split " << i;
    const bool grew =
        i > 0 && i < pm.splits.size() && pm.splits[i].error_m > pm.splits[i - 1].error_m;
    ASSERT_FALSE(grew) << "at split " << i;
    if (i == pm.splits.size()) break;
    ASSERT_EQ(mesh.vertices[pm.splits[i].vertex], pm.splits[i].vertex_coarse) << "at split " << i;
    test::apply_split(mesh, pm.splits[i]);
  }
  for (const Vec3& p : mesh.vertices) ASSERT_TRUE(on_lattice(p, lattice_));
  for (const VertexSplit& s : pm.splits) ASSERT_TRUE(on_lattice(s.vertex_coarse, lattice_));
}

TEST_P(EveryMethod, TheFineEndIsWhatWasAskedFor) {
  const ProgressiveMesh pm = make();
  const Tin fine = test::expand(pm, pm.splits.size());
  EXPECT_EQ(vertical_error(fine, grid_).max_m, pm.fine_error_m);
  if (GetParam().fine.max_error_m) {
    EXPECT_LE(pm.fine_error_m, *GetParam().fine.max_error_m + lattice_.z_step_m / 2);
    EXPECT_GT(pm.fine_error_m, 0.5 * *GetParam().fine.max_error_m);
  } else {
    EXPECT_EQ(fine.triangles.size(), terrain_mesh({grid_, 30, 25})->mesh.triangle_count());
    EXPECT_LE(pm.fine_error_m, lattice_.z_step_m / 2);
  }
}

constexpr StopAt kFull{}, kTwoMetres{.max_error_m = 2};
INSTANTIATE_TEST_SUITE_P(
    MakeProgressive, EveryMethod,
    testing::Values(Case{"edge-cost", kFull, false}, Case{"edge-cost", kTwoMetres, true},
                    Case{"qem", kFull, true}, Case{"qem", kTwoMetres, false},
                    Case{"memoryless", kTwoMetres, false}, Case{"memoryless", kFull, true},
                    Case{"attribute-qem", kTwoMetres, false}, Case{"attribute-qem", kFull, true},
                    Case{"triangle-collapse", kFull, false},
                    Case{"triangle-collapse", kTwoMetres, true}, Case{"bounded", kTwoMetres, false},
                    Case{"bounded", kFull, true}),
    name_of);

// A method's own order would spend the bound on few places.
TEST(MakeProgressive, AStateWithinABoundHasNearlyAsFewTrianglesAsAMeshMadeForIt) {
  const HeightGrid grid = test::rough_terrain(97, 97, 11, 200);
  const Terrain dem{grid, 30, 30};
  for (const std::string method : {"bounded", "qem", "memoryless", "attribute-qem"}) {
    SimplifyOptions o;
    o.method = *method_named(method);
    o.stop.max_error_m = 1;
    const Lattice lattice{8, 0.125};
    const auto pm = make_progressive(dem, o, 2, {}, lattice);
    ASSERT_TRUE(pm) << method;
    DemInfo info;
    info.cols = grid.cols(), info.rows = grid.rows();
    const auto stream = to_stream(*pm, lattice, info, kRungShare);
    ASSERT_TRUE(stream) << stream.error().what;
    const ProgressiveMesh read = from_stream(*stream);
    auto cursor = ProgressiveCursor::open(read);
    ASSERT_TRUE(cursor);
    for (const double error : {2.0, 5.0, 10.0, 20.0}) {
      SimplifyOptions alone;
      alone.method = *method_named("bounded");
      alone.stop.max_error_m = error;
      const double made = double(simplify(dem, alone)->tin.triangles.size());
      cursor->seek(cursor->position_for_error(error));
      EXPECT_LE(vertical_error(cursor->extract(), grid).max_m, error);
      const double most = method == "bounded" ? 1.5 : 1.9;
      EXPECT_LT(double(cursor->triangles()), most * made) << method << " within " << error;
    }
  }
}

TEST(MakeProgressive, TheLadderHoldsTheRoundBounds) {
  const auto rungs = error_ladder(0.15, 700);
  for (const double round : {0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 500.0})
    EXPECT_EQ(std::ranges::count(rungs, round), 1) << round;
  EXPECT_GT(rungs.front(), 0.15);
  EXPECT_GE(rungs.back(), 700);
  EXPECT_LT(rungs.back(), 750);
  for (std::size_t i = 1; i < rungs.size(); ++i) {
    EXPECT_GT(rungs[i], rungs[i - 1] * 1.05);
    EXPECT_LT(rungs[i], rungs[i - 1] * 1.07);
  }
}

TEST(MakeProgressive, SaysWhatItCannotDo) {
  const HeightGrid grid = test::rough_terrain(9, 9, 1);
  SimplifyOptions o;
  o.method = GreedyOptions{};
  EXPECT_NE(make_progressive({grid, 1, 1}, o, 2, {}).error().what.find("collapse"),
            std::string::npos);
  o.method = QemOptions{};
  EXPECT_EQ(make_progressive({grid, 1, 1}, o, 2, {}, {3, 0}).error().code, Errc::invalid_argument);
  EXPECT_EQ(make_progressive({grid, 1, 1}, o, 2, {}, {4, -1}).error().code, Errc::invalid_argument);
}

}  // namespace
}  // namespace tind
