#include "terrain/tile/border.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace tind {
namespace {

constexpr double kEnd = 32767;

/// Where an edge runs along a line of posts, there may be more of them than places for vertices.
TEST(Border, stays_near_samples_that_lie_closer_together_than_vertices_may) {
  std::mt19937 random(3);
  EdgeProfile own;
  for (double t = 0; t < kEnd; t += 0.55) {
    own.at.push_back(t);
    own.h.push_back(random() % 4 == 0 ? -9999 : double(random() % 3000));
  }
  own.at.push_back(kEnd), own.h.push_back(100);
  BorderOptions o;
  o.tolerance_m = 300;
  o.height_step = 1;
  o.fixed_cells = 8;
  const Border border = make_border(own, nullptr, o);
  EXPECT_GT(border.line.size(), 1000u);
  for (const BorderVertex& v : border.line) {
    EXPECT_GE(v.height, -9999 - o.tolerance_m - o.height_step) << v.t;
    EXPECT_LE(v.height, 3000 + o.tolerance_m + o.height_step) << v.t;
  }
  EXPECT_TRUE(std::ranges::is_sorted(border.line, {}, &BorderVertex::t));
}

}  // namespace
}  // namespace tind
