#include "terrain/progressive/stream/progressive_cursor.h"

#include <gtest/gtest.h>

#include <random>

#include "terrain/mesh/validity.h"
#include "terrain/progressive/stream/make_progressive.h"
#include "terrain/simplify/methods.h"
#include "tests/support/support.h"
#include "tests/terrain/progressive/expand.h"

namespace tind {
namespace {

ProgressiveMesh progressive(const char* method, int side, std::size_t base = 12,
                            bool voids = false) {
  HeightGrid grid = test::rough_terrain(side, side, 3, 120);
  if (voids)
    for (int r = 8; r < 14; ++r)
      for (int c = 4; c < 20 - r; ++c) grid.at(c, r) = HeightGrid::kVoid;
  SimplifyOptions o;
  o.method = *method_named(method);
  const auto pm = make_progressive({grid, 30, 30}, o, base, {}, {8, 0.125});
  EXPECT_TRUE(pm);
  return *pm;
}

TEST(ProgressiveCursor, EveryStateIsWhatTheDefinitionSays) {
  for (const char* method : {"qem", "edge-cost", "triangle-collapse"}) {
    const ProgressiveMesh pm = progressive(method, 27, 12, true);
    auto cursor = ProgressiveCursor::open(pm);
    ASSERT_TRUE(cursor) << cursor.error().what;
    Tin plain = pm.base;
    for (std::size_t i = 0;; ++i) {
      cursor->seek(i);
      const Tin fast = cursor->extract();
      ASSERT_EQ(fast.vertices, plain.vertices) << method << " " << i;
      ASSERT_EQ(test::sorted_triangles(fast), test::sorted_triangles(plain)) << method << " " << i;
      ASSERT_EQ(fast.triangles.size(), cursor->triangles());
      if (i == pm.splits.size()) break;
      test::apply_split(plain, pm.splits[i]);
    }
    cursor->seek(0);
    EXPECT_EQ(cursor->extract().vertices, pm.base.vertices);
    EXPECT_EQ(cursor->extract().triangles, pm.base.triangles);
  }
}

TEST(ProgressiveCursor, TenThousandSeeksGiveWhatExtractingDirectlyGives) {
  const ProgressiveMesh pm = progressive("qem", 65);
  auto cursor = ProgressiveCursor::open(pm);
  ASSERT_TRUE(cursor);
  std::mt19937 random(11);
  // The states to compare with, each from a cursor that came straight from the base.
  std::vector<std::size_t> at;
  std::vector<Tin> direct;
  for (int i = 0; i < 64; ++i) {
    at.push_back(random() % (pm.splits.size() + 1));
    auto fresh = ProgressiveCursor::open(pm);
    fresh->seek(at.back());
    direct.push_back(fresh->extract());
  }
  for (int i = 0; i < 10000; ++i) {
    const std::size_t k = random() % at.size();
    cursor->seek(at[k]);
    const Tin now = cursor->extract();
    ASSERT_EQ(now.vertices, direct[k].vertices);
    ASSERT_EQ(now.triangles, direct[k].triangles);
  }
}

TEST(ProgressiveCursor, AGeomorphGoesFromOneStateToTheNext) {
  const ProgressiveMesh pm = progressive("edge-cost", 25);
  auto cursor = ProgressiveCursor::open(pm);
  for (std::size_t i = 0; i < pm.splits.size(); i += 7) {
    cursor->seek(i);
    const Tin end = cursor->geomorph(1);
    for (const double t : {0.25, 0.75}) {
      const Tin between = cursor->geomorph(t);
      EXPECT_EQ(between.triangles, end.triangles);
      EXPECT_EQ(check_validity(between).bad_indices, 0u);
    }
    EXPECT_EQ(cursor->position(), i);
    const Tin start = cursor->geomorph(0);
    EXPECT_EQ(start.vertices.back(), start.vertices[pm.splits[i].vertex]);
    cursor->seek(i + 1);
    EXPECT_EQ(cursor->extract().vertices, end.vertices);
  }
}

TEST(ProgressiveCursor, FindsStatesByErrorAndByCount) {
  const ProgressiveMesh pm = progressive("qem", 33);
  auto cursor = ProgressiveCursor::open(pm);
  for (const double error : {1e9, 40.0, 5.0, 0.5}) {
    cursor->seek(cursor->position_for_error(error));
    EXPECT_LE(cursor->error_m(), error);
    if (cursor->position() == 0) continue;
    cursor->seek(cursor->position() - 1);
    EXPECT_GT(cursor->error_m(), error);
  }
  for (const std::size_t n : {1u, 100u, 501u, 100000u}) {
    cursor->seek(cursor->position_for_triangles(n));
    EXPECT_TRUE(cursor->triangles() <= n || cursor->position() == 0);
    if (cursor->position() == cursor->size()) continue;
    cursor->seek(cursor->position() + 1);
    EXPECT_GT(cursor->triangles(), n);
  }
}

TEST(ProgressiveCursor, RefusesSplitsThatNameWhatIsNotThere) {
  ProgressiveMesh pm = progressive("qem", 9);
  pm.splits[3].left = 1000000;
  EXPECT_EQ(ProgressiveCursor::open(pm).error().code, Errc::bad_data);
  pm.splits[3].left = pm.splits[3].right;
  EXPECT_FALSE(ProgressiveCursor::open(pm));
  pm.base.triangles.push_back(pm.base.triangles[0]);
  EXPECT_FALSE(ProgressiveCursor::open(pm));
}

}  // namespace
}  // namespace tind
