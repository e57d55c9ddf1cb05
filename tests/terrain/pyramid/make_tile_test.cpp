// How much of a source one tile holds at a time, whatever the source's shape.

#include "terrain/pyramid/make/make_tile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>

#include "terrain/pyramid/plan/plan_source.h"
#include "tests/support/made_up_source.h"

namespace tind {
namespace {

using test::MadeUpSource;
using test::rough_terrain;

/// Notes the largest read, and refuses one that would take gigabytes.
class WatchedSource : public MadeUpSource {
 public:
  using MadeUpSource::MadeUpSource;

  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int step) const override {
    const std::int64_t posts = std::int64_t(cols) * rows;
    {
      const std::lock_guard lock(mutex_);
      largest_ = std::max(largest_, posts);
    }
    if (posts > 1 << 26) return fail(Errc::internal, "a read of " + std::to_string(posts));
    return MadeUpSource::read_decimated(col, row, cols, rows, step);
  }
  std::int64_t largest() const { return largest_; }

 private:
  mutable std::mutex mutex_;
  mutable std::int64_t largest_ = 0;
};

/// The tiles over the source's middle, of all levels.
void expect_small_reads(const WatchedSource& source) {
  TileSetOptions options;
  options.effort = Effort::fast;
  const auto plan = plan_source(source, options, "", 1);
  ASSERT_TRUE(plan) << plan.error().what;
  const GeoRect& b = source.info().bounds;
  for (int z = 0; z <= plan->max_level(); ++z) {
    const double side = tiling::tile_degrees(z);
    const auto id = tiling::tile(z, std::int64_t(((b.west + b.east) / 2 + 180) / side),
                                 std::int64_t(((b.south + b.north) / 2 + 90) / side));
    ASSERT_TRUE(id);
    const auto tile = make_tile(source, *plan, *id);
    EXPECT_TRUE(tile) << id->text() << ": " << tile.error().what;
  }
  EXPECT_LE(source.largest(), 1 << 20);
}

TEST(MakeTile, of_a_small_fine_dem_holds_few_posts) {
  expect_small_reads(WatchedSource(rough_terrain(200, 200, 1), {7.1, 45.9}, 2.2e-5));
  expect_small_reads(WatchedSource(rough_terrain(120, 90, 2), {7.1, 45.9}, 2.2e-5, 0.1));
  expect_small_reads(WatchedSource(rough_terrain(2, 2, 3), {7.1, 45.9}, 1e-6));
}

TEST(MakeTile, of_a_small_dem_over_a_continent_holds_few_posts) {
  expect_small_reads(WatchedSource(rough_terrain(200, 200, 1), {-20, 60}, 0.3));
}

TEST(MakeTile, of_a_long_thin_dem_holds_few_posts) {
  constexpr int kLong = 600'000;
  expect_small_reads(WatchedSource(rough_terrain(kLong, 2, 1), {7.1, 45.9}, 1e-5));
  expect_small_reads(WatchedSource(rough_terrain(2, kLong, 1), {7.1, 45.9}, 1e-5));
  expect_small_reads(WatchedSource(rough_terrain(kLong, 2, 1), {7.1, 45.9}, 1e-5, 0.1));
}

}  // namespace
}  // namespace tind
