// A large DEM is served before all of it has been read.

#include "terrain/pyramid/make/dem_tiles.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <latch>
#include <limits>
#include <thread>

#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/store/tile_set.h"
#include "tests/support/layered_world.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

/// A source whose heights do not come until they are let go, but for the thread that made it.
class HeldSource : public DemSource {
 public:
  explicit HeldSource(std::shared_ptr<const DemSource> behind) : behind_(std::move(behind)) {}
  std::latch& gate() { return gate_; }

  const DemInfo& info() const override { return behind_->info(); }
  Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const override {
    wait();
    return behind_->read(col, row, cols, rows);
  }
  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int step) const override {
    wait();
    return behind_->read_decimated(col, row, cols, rows, step);
  }
  void to_post(std::span<const Geographic> in, std::span<Vec2> out) const override {
    behind_->to_post(in, out);
  }
  void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const override {
    behind_->to_geographic(in, out);
  }
  bool is_plain_geographic() const override { return behind_->is_plain_geographic(); }

 private:
  void wait() const {
    if (std::this_thread::get_id() != maker_) gate_.wait();
  }

  std::shared_ptr<const DemSource> behind_;
  const std::thread::id maker_ = std::this_thread::get_id();
  mutable std::latch gate_{1};
};

std::shared_ptr<const DemSource> rainier() {
  auto source = DemSource::open(std::vector<std::string>{test::testdata("rainier.tif")});
  if (!source) throw std::runtime_error(source.error().what);
  return *source;
}

TEST(DemTiles, are_busy_until_the_heights_are_known_and_then_the_same) {
  TileSetOptions options;
  options.max_error_m = 40;
  const auto at_once = open_dem_tiles(rainier(), options);
  ASSERT_TRUE(at_once);
  const auto held = std::make_shared<HeldSource>(rainier());
  const auto tiles = open_dem_tiles(held, options, 0);
  ASSERT_TRUE(tiles);
  EXPECT_EQ((*tiles)->layer().available, (*at_once)->layer().available);
  const TileId id{0, 0, 0};
  const auto early = (*tiles)->tile(id, {});
  ASSERT_FALSE(early);
  EXPECT_EQ(early.error().code, Errc::busy);
  EXPECT_EQ((*tiles)->readiness().state, Readiness::State::reading);
  EXPECT_LT((*tiles)->readiness().share, 1);
  held->gate().count_down();
  auto late = (*tiles)->tile(id, {});
  while (!late && late.error().code == Errc::busy) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    late = (*tiles)->tile(id, {});
  }
  ASSERT_TRUE(late) << late.error().what;
  EXPECT_EQ((*tiles)->readiness().state, Readiness::State::ready);
  EXPECT_EQ(late->bytes, (*at_once)->tile(id, {})->bytes);
}

TEST(DemTiles, are_there_at_once_where_they_do_not_rest_on_all_heights) {
  for (const std::int64_t exact_posts : {0, 1 << 16}) {
    TileSetOptions options;
    options.max_error_m = 40;
    options.exact_posts = exact_posts;
    const auto later = open_dem_tiles(rainier(), options);
    ASSERT_TRUE(later);
    const auto held = std::make_shared<HeldSource>(rainier());
    const auto tiles = open_dem_tiles(held, options, 0);
    ASSERT_TRUE(tiles);
    int early = 0, waiting = 0;
    for (std::size_t level = (*tiles)->layer().available.size(); level-- > 0;) {
      const proto::TileRange& there = (*tiles)->layer().available[level].front();
      const TileId id{int(level), there.start_x, there.start_y};
      const auto tile = (*tiles)->tile(id, {});
      if (!tile) {
        EXPECT_EQ(tile.error().code, Errc::busy) << tile.error().what;
        ++waiting;
        continue;
      }
      EXPECT_EQ(tile->bytes, (*later)->tile(id, {})->bytes) << id.text();
      ++early;
    }
    EXPECT_EQ((*tiles)->readiness().state, Readiness::State::reading);
    EXPECT_GE(early, 2);
    EXPECT_GE(waiting, 2) << "the roots rest on all heights";
    if (exact_posts > 0) {
      EXPECT_GT(waiting, 3) << "so do tiles of many posts";
    }
    held->gate().count_down();
  }
}

TEST(DemTiles, without_a_post_wait_until_one_with_a_post_was_made) {
  HeightGrid grid(400, 400);
  for (int r = 0; r < 400; ++r)
    for (int c = 200; c < 400; ++c) grid.at(c, r) = float(c + r);
  const auto held = std::make_shared<HeldSource>(test::made(std::move(grid), {10, 46}, 0.001));
  const auto tiles = open_dem_tiles(held, {}, 0);
  ASSERT_TRUE(tiles);
  const auto holding = [&](double lon) {
    const int z = (*tiles)->layer().maxzoom;
    const double side = tiling::tile_degrees(z);
    return TileId{z, std::uint32_t((lon + 180) / side), std::uint32_t((45.8 + 90) / side)};
  };
  const auto empty = (*tiles)->tile(holding(10.05), {});
  ASSERT_FALSE(empty);
  EXPECT_EQ(empty.error().code, Errc::busy);
  EXPECT_TRUE((*tiles)->tile(holding(10.3), {}));
  EXPECT_TRUE((*tiles)->tile(holding(10.05), {}));
  held->gate().count_down();
}

TEST(DemTiles, keep_the_index_that_they_made) {
  const test::TempDir dir;
  TileSetOptions options;
  options.max_error_m = 40;
  options.exact_posts = 1 << 16;
  const auto path = dir.file("rainier.residuals");
  const TileId id{5, 10, 24};
  std::vector<std::uint8_t> bytes;
  std::filesystem::file_time_type made;
  for (int run = 0; run < 2; ++run) {
    const auto tiles = open_dem_tiles(rainier(), options, 0, path);
    ASSERT_TRUE(tiles);
    auto tile = (*tiles)->tile(id, {});
    while (!tile && tile.error().code == Errc::busy) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      tile = (*tiles)->tile(id, {});
    }
    ASSERT_TRUE(tile) << tile.error().what;
    EXPECT_FALSE(tile->exact);
    if (run == 0) bytes = tile->bytes, made = std::filesystem::last_write_time(path);
    EXPECT_EQ(tile->bytes, bytes);
    EXPECT_EQ(std::filesystem::last_write_time(path), made);
  }
}

TEST(DemTiles, of_layers_keep_the_index_and_read_no_post_for_a_plan_again) {
  const test::TempDir dir;
  const auto base = std::make_shared<const test::MadeUpSource>(test::rough_terrain(60, 50, 1, 2000),
                                                               Geographic{10, 50}, 0.02);
  const Surface surface = *Surface::of_layers(
      {{"base", base}, {"fine", test::made(test::rough_terrain(90, 90, 2), {10.3, 49.7}, 0.004)}});
  TileSetOptions options;
  options.exact_posts = 1 << 12;
  const auto path = dir.file("layers.residuals");
  const auto first = open_dem_tiles(surface, options, kMostReadAtOnce, path);
  ASSERT_TRUE(first) << first.error().what;
  base->reads_left = 0;
  {
    const auto again = open_dem_tiles(surface, options, kMostReadAtOnce, path);
    ASSERT_TRUE(again) << again.error().what;
    EXPECT_EQ((*again)->layer().version, (*first)->layer().version);
    ASSERT_TRUE((*again)->extremes() && (*first)->extremes());
    EXPECT_EQ((*again)->extremes()->highest.height_m, (*first)->extremes()->highest.height_m);
    base->reads_left = std::numeric_limits<std::int64_t>::max();
    const TileId id{4, 16, 12};
    EXPECT_EQ((*again)->tile(id, {})->bytes, (*first)->tile(id, {})->bytes);
    EXPECT_FALSE((*again)->tile(id, {})->exact);
  }
  // Of other levels, or damaged: posts are read again.
  for (const bool damaged : {false, true}) {
    if (damaged) std::filesystem::resize_file(path + ".range", 60);
    options.max_level = damaged ? -1 : 9;
    base->reads_left = 0;
    EXPECT_FALSE(open_dem_tiles(surface, options, kMostReadAtOnce, path)) << damaged;
    base->reads_left = std::numeric_limits<std::int64_t>::max();
    EXPECT_TRUE(open_dem_tiles(surface, options, kMostReadAtOnce, path)) << damaged;
  }
}

TEST(DemTiles, read_again_what_could_not_be_read) {
  const test::TempDir folder;
  TileSetOptions options;
  options.exact_posts = 5000;
  const std::string index = folder.file("later/index");
  const auto tiles = open_dem_tiles(rainier(), options, 0, index);
  ASSERT_TRUE(tiles);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // the folder is not there
  EXPECT_EQ((*tiles)->readiness().state, Readiness::State::reading);
  std::filesystem::create_directory(folder.file("later"));
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(10);
  while ((*tiles)->readiness().state == Readiness::State::reading &&
         std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ((*tiles)->readiness().state, Readiness::State::ready) << (*tiles)->readiness().why;
  EXPECT_TRUE((*tiles)->tile({0, 0, 0}, {}));
}

TEST(DemTiles, can_be_closed_while_heights_are_read) {
  const auto held = std::make_shared<HeldSource>(rainier());
  auto tiles = open_dem_tiles(held, {}, 0);
  ASSERT_TRUE(tiles);
  held->gate().count_down();
  tiles->reset();
}

}  // namespace
}  // namespace tind
