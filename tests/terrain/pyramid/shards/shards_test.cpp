// However many shards there are, whoever makes them and in whichever order: what is merged of them
// is what one build makes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <numeric>
#include <random>

#include "terrain/base/file_io.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/make/make_tile.h"
#include "terrain/pyramid/residual/residual_index.h"
#include "terrain/pyramid/shards/make_shard.h"
#include "terrain/pyramid/shards/merge_shards.h"
#include "terrain/pyramid/shards/plan_shards.h"
#include "terrain/pyramid/shards/shard_files.h"
#include "terrain/pyramid/shards/shard_plan.h"
#include "terrain/store/copy/copy_store.h"
#include "terrain/store/folder/folder_lock.h"
#include "terrain/store/folder/folder_writer.h"
#include "terrain/store/open/open_store.h"
#include "tests/support/layered_world.h"
#include "tests/support/made_up_source.h"
#include "tests/support/support.h"
#include "tests/support/watched_files.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int kPosts = test::kSanitized ? 300 : 460;
constexpr std::size_t kTop = ShardTiles::kTop;

/// Hills, a rough corner and a void one: cheap tiles, and dear ones.
HeightGrid hills() {
  HeightGrid grid(kPosts, kPosts);
  std::mt19937 random(7);
  for (int r = 0; r < kPosts; ++r)
    for (int c = 0; c < kPosts; ++c) {
      float z = float(300 * std::sin(c / 60.0) * std::cos(r / 45.0));
      if (c < 60 && r < 60) z += float(random() % 200);
      grid.at(c, r) = c > kPosts - 80 && r > kPosts - 50 ? std::nanf("") : z;
    }
  return grid;
}

std::shared_ptr<const DemSource> dem_of(HeightGrid grid) {
  return std::make_shared<const test::MadeUpSource>(std::move(grid), Geographic{-121.9, 46.95},
                                                    1 / 1200.0);
}

/// A build whose disk is quick.
Result<std::unique_ptr<LockedStore>> unsynced(const std::string& output) {
  return lock_folder(output, std::make_shared<test::Unsynced>());
}

class ShardsTest : public testing::Test {
 protected:
  static BuildOptions options(std::int64_t exact_posts = 0) {
    BuildOptions o;
    o.tiles.max_error_m = 10;
    o.tiles.effort = Effort::fast;
    o.tiles.exact_posts = exact_posts;
    o.threads = 2;
    return o;
  }
  static const Surface& surface() {
    static const Surface s(dem_of(hills()));
    return s;
  }
  /// What one build makes, as one file.
  static const std::string& built() {
    static const std::string bytes = [] {
      BuildOptions o = options();
      const test::TempDir folder;
      o.output = folder.file("tiles");
      o.lock = unsynced;
      const auto report = build_tiles(surface(), o);
      EXPECT_TRUE(report) << report.error().what;
      EXPECT_TRUE(copy_store(*open_store(o.output), folder.file("all.pmtiles"), {}));
      return read_whole_file(folder.file("all.pmtiles")).value_or("");
    }();
    return bytes;
  }
  static ShardPlan plan_of(std::uint64_t shards, const BuildOptions& o = options()) {
    auto plan = plan_shards(surface(), o, {.shards = shards}, {});
    EXPECT_TRUE(plan) << plan.error().what;
    return std::move(*plan);
  }
  Result<ShardReport> make(const ShardPlan& plan, std::size_t shard,
                           const Progress& progress = {}) const {
    return make_shard(surface(), plan, shard, {.folder = at(), .threads = 2}, progress);
  }
  void make_all(const ShardPlan& plan) const {
    for (std::size_t i = 0; i < plan.shards.size(); ++i) {
      const auto report = make(plan, i);
      ASSERT_TRUE(report) << report.error().what;
    }
  }
  Result<MergeReport> merge(const ShardPlan& plan, const std::string& to) const {
    MergeOptions o;
    o.shards = {.folder = at(), .threads = 2};
    o.output = to;
    return merge_shards(
        plan, [] { return Result<Surface>(surface()); }, o);
  }
  void expect_built(const ShardPlan& plan, const std::string& name = "merged.pmtiles") const {
    const auto merged = merge(plan, folder_.file(name));
    ASSERT_TRUE(merged) << merged.error().what;
    EXPECT_TRUE(read_whole_file(folder_.file(name)).value_or("") == built());
  }
  /// The file of the index that one pass makes.
  std::string index_of(const Surface& surface, const BuildOptions& o) const {
    const std::string path = folder_.file("one.residuals");
    const auto made =
        ResidualIndex::open_or_make(path, surface, IndexDepth::of(surface, o.tiles.exact_posts), 2);
    EXPECT_TRUE(made) << made.error().what;
    return path;
  }
  std::string at() const { return folder_.path().string(); }
  ShardFolder shards() const { return ShardFolder(at()); }

  test::TempDir folder_;
};

void damage(const std::string& path, std::size_t at) {
  std::string bytes = *read_whole_file(path);
  ASSERT_LT(at, bytes.size());
  bytes[at] = char(bytes[at] ^ 4);
  std::ofstream(path, std::ios::binary) << bytes;
}

// ---- the plan ----

TEST_F(ShardsTest, APlanIsAFunctionOfHeightsAndOptions) {
  const ShardPlan plan = plan_of(7);
  EXPECT_EQ(encode(plan), encode(plan_of(7)));
  EXPECT_NE(plan.hash(), plan_of(6).hash());
  BuildOptions other = options();
  other.tiles.max_error_m = 11;
  EXPECT_NE(plan.hash(), plan_of(7, other).hash());
  ShardPlan elsewhere = plan;
  elsewhere.source.files = {"/elsewhere/dem.tif"};
  EXPECT_EQ(plan.hash(), elsewhere.hash());
  const auto back = decode_shard_plan(encode(elsewhere));
  ASSERT_TRUE(back) << back.error().what;
  EXPECT_EQ(encode(*back), encode(elsewhere));
}

TEST_F(ShardsTest, EveryTileIsOfOneShard) {
  const ShardPlan plan = plan_of(7);
  const auto tiles = ShardTiles::of(plan);
  ASSERT_TRUE(tiles);
  std::map<TileId, std::size_t> owner;
  for (std::size_t i = 0; i <= plan.shards.size(); ++i) {
    const std::size_t shard = i == plan.shards.size() ? kTop : i;
    for (const TileId id : tiles->in_order(shard)) {
      EXPECT_TRUE(owner.emplace(id, shard).second) << id.text();
      EXPECT_EQ(tiles->shard_of(id), shard) << id.text();
    }
  }
  EXPECT_EQ(owner.size(), plan.tiles());
  std::uint64_t least = ~std::uint64_t(0), most = 0;
  for (const auto& s : plan.shards) least = std::min(least, s.cost), most = std::max(most, s.cost);
  EXPECT_LT(most, 3 * least) << "the shards' costs are far from even";
}

TEST_F(ShardsTest, APlanThatDoesNotHoldTogetherIsRefused) {
  const std::string text = encode(plan_of(3));
  ASSERT_TRUE(decode_shard_plan(text));
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    const auto at = changed.find(from);
    EXPECT_NE(at, changed.npos) << from;
    return changed.replace(at, from.size(), to);
  };
  for (const std::string& bad :
       {std::string(), std::string("{}"), text.substr(0, text.size() / 2),
        with("\"tind_plan\": 1", "\"tind_plan\": 2"), with("\"top_tiles\": ", "\"top_tiles\": 1"),
        with("\"level\": ", "\"level\": 1"), with("\"content\": {", "\"content\": {\"more\": 1,"),
        with("\"files\": []", "\"files\": [7]"), with("max_error_m", "max_error_n")}) {
    const auto plan = decode_shard_plan(bad);
    ASSERT_FALSE(plan);
    EXPECT_EQ(plan.error().code, Errc::bad_data);
  }
  // A hash of its own does not make it right.
  ShardPlan wrong = plan_of(3);
  wrong.shards[0].tiles += 1, wrong.shards[1].tiles -= 1;
  EXPECT_FALSE(decode_shard_plan(encode(wrong)));
  wrong = plan_of(3);
  wrong.level += 1;
  EXPECT_FALSE(decode_shard_plan(encode(wrong)));
  wrong = plan_of(3);
  wrong.blocks[wrong.blocks.size() / 2] ^= 1;
  EXPECT_FALSE(decode_shard_plan(encode(wrong)));
}

TEST_F(ShardsTest, SoManyShardsMustBePossible) {
  const auto plan = plan_shards(surface(), options(), {.shards = 100'000}, {});
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().code, Errc::invalid_argument);
  const auto by_tiles = plan_shards(surface(), options(), {.tiles_per_shard = 20}, {});
  ASSERT_TRUE(by_tiles);
  EXPECT_EQ(by_tiles->shards.size(), (by_tiles->tiles() + 19) / 20);
}

// ---- the same bytes ----

class AnyNumber : public ShardsTest, public testing::WithParamInterface<int> {};

TEST_P(AnyNumber, OfShardsInAnyOrderIsTheBuild) {
  const ShardPlan plan = plan_of(std::uint64_t(GetParam()));
  std::vector<std::size_t> order(plan.shards.size());
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(1));
  for (const std::size_t shard : order) {
    const auto report = make(plan, shard);
    ASSERT_TRUE(report) << report.error().what;
    EXPECT_EQ(report->made, plan.shards[shard].tiles);
  }
  expect_built(plan);
}

INSTANTIATE_TEST_SUITE_P(Shards, AnyNumber,
                         testing::ValuesIn(test::kSanitized ? std::vector{3}
                                                            : std::vector{1, 3, 7, 16}),
                         [](const auto& number) { return "Of" + std::to_string(number.param); });

TEST_F(ShardsTest, ADirectoryOfThemIsTheOneOfTheBuild) {
  const ShardPlan plan = plan_of(2);
  make_all(plan);
  const auto merged = merge(plan, folder_.file("tiles"));
  ASSERT_TRUE(merged) << merged.error().what;
  EXPECT_EQ(merged->tiles, plan.tiles());
  BuildOptions o = options();
  o.output = folder_.file("tiles");
  EXPECT_TRUE(*is_merged(plan, o.output));
  EXPECT_FALSE(*is_merged(plan_of(2,
                                  [] {
                                    BuildOptions other = options();
                                    other.tiles.max_error_m = 11;
                                    return other;
                                  }()),
                          o.output))
      << "of another plan";
  const auto again = build_tiles(surface(), o);
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->built, 0u) << "a build goes on with it as with its own";
  ASSERT_TRUE(copy_store(*open_store(o.output), folder_.file("back.pmtiles"), {}));
  EXPECT_TRUE(*read_whole_file(folder_.file("back.pmtiles")) == built());
}

TEST_F(ShardsTest, CoarseTilesMayRestOnTheIndex) {
  BuildOptions o = options(kPosts * kPosts * 5 / 9);
  o.output = folder_.file("one");
  o.lock = unsynced;
  const auto report = build_tiles(surface(), o);
  ASSERT_TRUE(report) << report.error().what;
  ASSERT_GE(report->indexed_level, 0);
  ASSERT_TRUE(copy_store(*open_store(o.output), folder_.file("one.pmtiles"), {}));
  const ShardPlan plan = plan_of(2, o);
  EXPECT_GT(plan.level, report->indexed_level);
  make_all(plan);
  // Each made a part of the index; what they made is what one pass over all posts makes.
  for (const std::size_t shard : {0u, 1u}) EXPECT_TRUE(fs::exists(shards().residuals(shard)));
  ASSERT_TRUE(merge(plan, folder_.file("merged.pmtiles")));
  EXPECT_TRUE(*read_whole_file(shards().path() + "/residuals") ==
              *read_whole_file(index_of(surface(), o)));
  EXPECT_TRUE(*read_whole_file(folder_.file("one.pmtiles")) ==
              *read_whole_file(folder_.file("merged.pmtiles")));
}

TEST_F(ShardsTest, APartOfTheIndexThatIsNotAsItsRecordSaysIsMadeAgain) {
  const BuildOptions o = options(kPosts * kPosts * 5 / 9);
  const ShardPlan plan = plan_of(2, o);
  make_all(plan);
  const std::string part = shards().residuals(0), good = *read_whole_file(part);
  for (const bool flipped : {true, false}) {
    if (flipped)
      damage(part, good.size() / 2);
    else
      fs::remove(part);
    const auto merged = merge(plan, folder_.file("x.pmtiles"));
    ASSERT_FALSE(merged);
    EXPECT_EQ(merged.error().code, Errc::bad_data);
    EXPECT_THAT(merged.error().what, HasSubstr("00000.residuals"));
    ASSERT_TRUE(make(plan, 0));
    EXPECT_TRUE(*read_whole_file(part) == good);
  }
}

TEST_F(ShardsTest, TheTopMakesWhatNoShardKnowsOfTheIndex) {
  const BuildOptions o = options(kPosts * kPosts * 5 / 9);
  const ShardPlan plan = plan_of(2, o);
  ASSERT_TRUE(make(plan, 1));
  ASSERT_TRUE(make(plan, kTop)) << "before the first shard";
  EXPECT_TRUE(*read_whole_file(shards().path() + "/residuals") ==
              *read_whole_file(index_of(surface(), o)));
}

TEST_F(ShardsTest, OfLayersTheIndexIsMadeByShardsToo) {
  const auto layered = Surface::of_layers(
      {{"base", test::made(test::rough_terrain(120, 120, 1, 500), {10, 50}, 0.004)},
       {"town", test::made(test::rough_terrain(120, 120, 2, 500), {10.1, 49.9}, 0.0005)}});
  ASSERT_TRUE(layered) << layered.error().what;
  const BuildOptions o = options(4000);
  const IndexDepth depth = IndexDepth::of(*layered, o.tiles.exact_posts);
  ASSERT_GT(depth.level(), depth.coarsest_level()) << "deeper below the town";
  const auto plan = plan_shards(*layered, o, {.shards = 3}, {});
  ASSERT_TRUE(plan) << plan.error().what;
  const auto outline = planned_tiles(*layered, *plan);
  const auto tiles = ShardTiles::of(*plan);
  ASSERT_TRUE(outline && tiles);
  const auto all = scanned_tiles(*layered, depth);
  std::map<TileId, int> made;
  std::vector<IndexPart> parts;
  for (const std::size_t shard : {2u, 0u, 1u}) {
    const auto mine = residual_tiles(*layered, *outline, *tiles, shard);
    for (const TileId id : mine) ++made[id];
    parts.push_back({folder_.file(std::to_string(shard)), plan->hash()});
    const auto done = make_index_part(parts.back(), folder_.file("own"), *layered, depth, mine, 2);
    ASSERT_TRUE(done) << done.error().what;
  }
  for (const TileId id : all) EXPECT_EQ(made[id], 1) << id.text();
  const std::string joined = folder_.file("joined");
  ASSERT_TRUE(ResidualIndex::open_or_make(joined, *layered, depth, 2, {}, parts));
  EXPECT_TRUE(*read_whole_file(joined) == *read_whole_file(index_of(*layered, o)));
}

// ---- stopped, killed, damaged ----

TEST_F(ShardsTest, AStoppedShardGoesOnTileByTile) {
  const ShardPlan plan = plan_of(1);
  std::stop_source stop;
  Progress progress;
  progress.stop = stop.get_token();
  progress.report = [&](double share) {
    if (share > 0.4) stop.request_stop();
  };
  const auto stopped = make(plan, 0, progress);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::cancelled);
  EXPECT_FALSE(fs::exists(shards().pack(0)));
  EXPECT_EQ(merge(plan, folder_.file("x.pmtiles")).error().code, Errc::busy);
  // A cut power leaves a torn end.
  fs::resize_file(shards().tiles(0), fs::file_size(shards().tiles(0)) - 3);
  const auto finished = make(plan, 0);
  ASSERT_TRUE(finished) << finished.error().what;
  EXPECT_GT(finished->kept, 0u);
  EXPECT_LT(finished->made, finished->tiles);
  EXPECT_FALSE(fs::exists(shards().tiles(0)));
  expect_built(plan);
}

TEST_F(ShardsTest, OnlyARecordCommitsAPack) {
  const ShardPlan plan = plan_of(3);
  make_all(plan);
  const std::string record = *read_whole_file(shards().record(1));
  fs::remove(shards().record(1));  // killed between pack and record
  const auto merged = merge(plan, folder_.file("x.pmtiles"));
  ASSERT_FALSE(merged);
  EXPECT_EQ(merged.error().code, Errc::busy);
  EXPECT_THAT(merged.error().what, HasSubstr("1 of 3 shards are not there: 1;"));
  EXPECT_FALSE(fs::exists(folder_.file("x.pmtiles")));
  EXPECT_FALSE(*is_merged(plan, folder_.file("x.pmtiles")));
  ASSERT_TRUE(make(plan, 1));
  EXPECT_EQ(*read_whole_file(shards().record(1)), record);
  expect_built(plan);
}

TEST_F(ShardsTest, WhatIsNotAsItsRecordSaysIsRefusedAndMadeAgain) {
  const ShardPlan plan = plan_of(3);
  make_all(plan);
  const std::string pack = shards().pack(2), good = *read_whole_file(pack);
  const std::function<void()> wrongs[] = {
      [&] { fs::resize_file(pack, good.size() - 1); },
      [&] { damage(pack, good.size() / 2); },
      [&] { fs::remove(pack); },
      [&] { damage(shards().record(2), 40); },
      [&] {
        fs::copy_file(shards().record(1), shards().record(2), fs::copy_options::overwrite_existing);
      },
  };
  for (const auto& wrong : wrongs) {
    wrong();
    const auto status = shard_status(plan, shards(), {.every_byte = true});
    ASSERT_TRUE(status);
    EXPECT_EQ((*status)[2].state, ShardState::failed);
    const auto merged = merge(plan, folder_.file("x.pmtiles"));
    ASSERT_FALSE(merged);
    EXPECT_EQ(merged.error().code, Errc::bad_data) << merged.error().what;
    EXPECT_FALSE(fs::exists(folder_.file("x.pmtiles")));
    const auto again = make(plan, 2);
    ASSERT_TRUE(again) << again.error().what;
    EXPECT_FALSE(again->there);
    EXPECT_TRUE(*read_whole_file(pack) == good);
  }
  EXPECT_TRUE(make(plan, 2)->there);
  expect_built(plan);
}

/// Who makes again what the one line names is done.
TEST_F(ShardsTest, WhatIsBrokenAndWhatIsMissingAreNamedTogether) {
  const ShardPlan plan = plan_of(3);
  ASSERT_TRUE(make(plan, 1));
  ASSERT_TRUE(make(plan, 2));
  damage(shards().pack(2), 100);
  const auto merged = merge(plan, folder_.file("x.pmtiles"));
  ASSERT_FALSE(merged);
  EXPECT_EQ(merged.error().code, Errc::bad_data);
  EXPECT_THAT(merged.error().what, testing::HasSubstr("should be): 2; 1 are not there: 0"));
}

/// Then it need not be made again.
TEST_F(ShardsTest, WhatCannotBeReadIsNotTakenForBroken) {
  const ShardPlan plan = plan_of(2);
  ASSERT_TRUE(make(plan, 0));
  for (const std::string& path : {shards().pack(0), shards().record(0)}) {
    fs::rename(path, folder_.file("away"));
    fs::create_symlink(path, path);  // round in a circle: also root cannot follow it
    EXPECT_TRUE((*shard_status(plan, shards()))[0].unread);
    const auto merged = merge(plan, folder_.file("x.pmtiles"));
    ASSERT_FALSE(merged);
    EXPECT_EQ(merged.error().code, Errc::io) << merged.error().what;
    fs::rename(folder_.file("away"), path);
    EXPECT_EQ((*shard_status(plan, shards(), {.every_byte = true}))[0].state, ShardState::done);
  }
  fs::remove(shards().plan());
  fs::create_symlink(shards().plan(), shards().plan());
  EXPECT_EQ(make(plan, 1).error().code, Errc::io);
}

TEST_F(ShardsTest, ShardsOfAnotherPlanAreNotTaken) {
  const ShardPlan plan = plan_of(3);
  make_all(plan);
  BuildOptions o = options();
  o.tiles.max_error_m = 12;
  const ShardPlan other = plan_of(3, o);
  const auto merged = merge(other, folder_.file("x.pmtiles"));
  ASSERT_FALSE(merged);
  EXPECT_EQ(merged.error().code, Errc::bad_data);
  EXPECT_THAT(merged.error().what, HasSubstr("of another plan"));
}

/// Voids are filled by posts that lie outside of a shard's tiles.
TEST_F(ShardsTest, WhatIsNotRefusedMakesTheSameTiles) {
  static constexpr double kStep = 180.0 / (1 << 16);  // the rim of the DEM is tiles' edges
  const auto with_void = [](float higher) {
    HeightGrid grid(257, 257, 0);
    for (int r = 0; r < 257; ++r)
      for (int c = 0; c < 257; ++c)
        grid.at(c, r) = c >= 5 && c < 116
                            ? HeightGrid::kVoid
                            : float(500 + c % 7 + r % 5 + (c > 115 && c < 230 ? higher : 0));
    return Surface(std::make_shared<const test::MadeUpSource>(std::move(grid),
                                                              Geographic{0, 256 * kStep}, kStep));
  };
  const Surface planned = with_void(0), other = with_void(100);
  const auto plan = plan_shards(planned, options(), {.shards = 16}, {});
  ASSERT_TRUE(plan);
  const auto tiles = ShardTiles::of(*plan);
  const auto pyramid = planned_tiles(planned, *plan);
  ASSERT_TRUE(tiles && pyramid);
  for (std::size_t shard = 0; shard < plan->shards.size(); ++shard) {
    EXPECT_TRUE(check_planned_posts(planned, *pyramid, *plan, *tiles, shard, 2));
    if (!check_planned_posts(other, *pyramid, *plan, *tiles, shard, 2)) continue;
    for (const TileId id : tiles->in_order(shard)) {
      const auto right = make_tile(planned, *pyramid, id, {}),
                 made = make_tile(other, *pyramid, id, {});
      ASSERT_TRUE(right && made);
      ASSERT_EQ(right->bytes, made->bytes) << id.text() << " of shard " << shard;
    }
  }
}

TEST_F(ShardsTest, ASourceThatChangedIsRefused) {
  const ShardPlan plan = plan_of(4);
  HeightGrid changed = hills();
  changed.at(5, 5) += 0.25F;  // in the north-west
  const auto tiles = ShardTiles::of(plan);
  ASSERT_TRUE(tiles);
  const Surface other(dem_of(std::move(changed)));
  const auto pyramid = planned_tiles(surface(), plan);
  ASSERT_TRUE(pyramid);
  std::size_t refused = 0;
  for (const std::size_t shard : {std::size_t(0), std::size_t(1), std::size_t(2), std::size_t(3)}) {
    const auto same = check_planned_posts(other, *pyramid, plan, *tiles, shard, 1);
    refused += !same;
    if (!same) {
      EXPECT_EQ(same.error().code, Errc::invalid_argument);
      EXPECT_THAT(same.error().what, HasSubstr("column 0, row 0"));
      const auto report = make_shard(other, plan, shard, {.folder = at(), .threads = 1});
      EXPECT_FALSE(report);
      const auto status = shard_status(plan, shards());
      ASSERT_TRUE(status);
      EXPECT_EQ((*status)[shard].state, ShardState::failed);
    }
  }
  EXPECT_GE(refused, 1u);
  EXPECT_LT(refused, 4u) << "of some no tile depends on that post";
  EXPECT_FALSE(check_planned_posts(other, *pyramid, plan, *tiles, kTop, 1));
  const Surface moved(
      std::make_shared<const test::MadeUpSource>(hills(), Geographic{-121.8, 46.95}, 1 / 1200.0));
  EXPECT_EQ(planned_tiles(moved, plan).error().code, Errc::invalid_argument);
}

// ---- status ----

TEST_F(ShardsTest, StatusHearsWhoRuns) {
  const ShardPlan plan = plan_of(3);
  auto status = shard_status(plan, shards());
  ASSERT_TRUE(status);
  EXPECT_EQ((*status)[0].state, ShardState::missing);
  ASSERT_TRUE(make(plan, 0));
  {
    Heartbeat heart(shards().beat(1), plan.shards[1].tiles, 0.01);
    heart.made(5);
    std::uint64_t made = 0;
    while (made != 5) {
      status = shard_status(plan, shards());
      ASSERT_TRUE(status);
      ASSERT_EQ((*status)[1].state, ShardState::running);
      made = (*status)[1].made;
    }
    EXPECT_EQ((*status)[0].state, ShardState::done);
    EXPECT_EQ((*status)[2].state, ShardState::missing);
  }
  EXPECT_EQ((*shard_status(plan, shards()))[1].state, ShardState::missing);
  // A word of long ago is none.
  std::ofstream(shards().path() + "/00001.elsewhere-1.beat") << "{\"made\": 3}";
  EXPECT_EQ((*shard_status(plan, shards()))[1].state, ShardState::running);
  fs::last_write_time(shards().path() + "/00001.elsewhere-1.beat",
                      fs::file_time_type::clock::now() - std::chrono::hours(2));
  EXPECT_EQ((*shard_status(plan, shards()))[1].state, ShardState::missing);
  remove_leftovers(shards());
  EXPECT_FALSE(fs::exists(shards().path() + "/00001.elsewhere-1.beat"));
  EXPECT_TRUE(fs::exists(shards().pack(0)));
}

/// As a kill leaves them just before they get their names.
TEST_F(ShardsTest, UnfinishedFilesGoAndOnlyThose) {
  fs::create_directories(shards().path());
  const auto put = [](const std::string& path, double hours) {
    std::ofstream(path) << "half";
    fs::last_write_time(
        path, fs::file_time_type::clock::now() - std::chrono::seconds(std::int64_t(3600 * hours)));
  };
  const std::string own[] = {"plan.partial-0123456789abcdef", "00001.json.partial-0123456789abcdef",
                             "123456.json.partial-00000000ffffffff",
                             "top.error.partial-0123456789abcdef"};
  const std::string others[] = {"thesis.json.partial-0123456789abcdef", "00001.json.partial-01234",
                                "00001.json.partial-0123456789abcdeg", "00001.json",
                                "1.json.partial-0123456789abcdef"};
  for (const auto& name : own) put(shards().path() + "/" + name, 2);
  for (const auto& name : others) put(shards().path() + "/" + name, 2);
  const std::string young = shards().path() + "/00002.json.partial-0123456789abcdef";
  put(young, 0);
  remove_leftovers(shards());
  for (const auto& name : own) EXPECT_FALSE(fs::exists(shards().path() + "/" + name)) << name;
  for (const auto& name : others) EXPECT_TRUE(fs::exists(shards().path() + "/" + name)) << name;
  EXPECT_TRUE(fs::exists(young)) << "somebody writes it";
  const std::string plan = folder_.file("PLAN.json"), ending = ".partial-0123456789abcdef";
  put(plan, 2), put(plan + ending, 2), put(folder_.file("OTHER.json") + ending, 2);
  remove_unfinished(plan);
  EXPECT_FALSE(fs::exists(plan + ending));
  EXPECT_TRUE(fs::exists(plan));
  EXPECT_TRUE(fs::exists(folder_.file("OTHER.json") + ending));
}

}  // namespace
}  // namespace tind
