#include "server/services/tiles/tile_cache.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <thread>
#include <vector>

namespace tind::services {
namespace {

TileCache::Tile tile_of(const std::string& body) {
  return http::Representation::make(body, {.content_type = "a/b", .compress = false});
}

TEST(TileCache, FindsWhatWasInserted) {
  TileCache cache(1 << 20);
  const TileKey key{1, {5, 3, 2}, 4};
  EXPECT_EQ(cache.find(key), nullptr);
  cache.insert(key, tile_of("hello"));
  ASSERT_NE(cache.find(key), nullptr);
  EXPECT_EQ(cache.find(key)->body(), "hello");
  for (const TileKey& other :
       {TileKey{0, {5, 3, 2}, 4}, TileKey{1, {6, 3, 2}, 4}, TileKey{1, {5, 2, 3}, 4},
        TileKey{1, {5, 3, 2}, 0}, TileKey{1, {5, 3, 2}, 4, 1}})
    EXPECT_EQ(cache.find(other), nullptr);
  cache.insert(key, tile_of("again"));
  EXPECT_EQ(cache.find(key)->body(), "again");
  EXPECT_EQ(cache.tiles(), 1u);
}

TEST(TileCache, NeverHoldsMoreThanItsBound) {
  constexpr std::size_t kBound = 2 << 20;
  TileCache cache(kBound);
  std::mt19937 random(3);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    cache.insert({0, {20, i, 0}, 0}, tile_of(std::string(random() % 20'000, 'x')));
    ASSERT_LE(cache.bytes(), kBound);
  }
  EXPECT_GT(cache.bytes(), kBound / 2) << "and makes use of it";
  EXPECT_EQ(cache.tiles() + cache.evictions(), 2000u);
}

TEST(TileCache, TheLeastRecentlyUsedGoesFirst) {
  TileCache cache(1 << 20);  // 64 KiB a shard
  const TileKey used{7, {3, 1, 1}, 0};
  cache.insert(used, tile_of(std::string(1000, 'u')));
  for (std::uint32_t i = 0; i < 5000; ++i) {
    cache.insert({0, {20, i, 0}, 0}, tile_of(std::string(1000, 'x')));
    ASSERT_NE(cache.find(used), nullptr) << i;
  }
  EXPECT_EQ(cache.find({0, {20, 0, 0}, 0}), nullptr);
}

TEST(TileCache, WhatIsOnlyPeekedAtAgesLikeTheRest) {
  TileCache cache(1 << 20);
  const TileKey peeked{7, {3, 1, 1}, 0};
  cache.insert(peeked, tile_of(std::string(1000, 'u')));
  std::uint32_t i = 0;
  while (cache.peek(peeked) && i < 5000)
    cache.insert({0, {20, i++, 0}, 0}, tile_of(std::string(1000, 'x')));
  EXPECT_LT(i, 5000u);
}

TEST(TileCache, WhatIsTooLargeIsNotKept) {
  TileCache cache(1 << 20);
  cache.insert({0, {1, 1, 1}, 0}, tile_of(std::string(100'000, 'x')));
  EXPECT_EQ(cache.tiles(), 0u);
  TileCache nothing(0);
  nothing.insert({0, {1, 1, 1}, 0}, tile_of("x"));
  EXPECT_EQ(nothing.find({0, {1, 1, 1}, 0}), nullptr);
}

TEST(TileCache, ManyThreads) {
  TileCache cache(1 << 18);
  std::vector<std::thread> threads;
  for (unsigned seed = 0; seed < 4; ++seed)
    threads.emplace_back([&cache, seed] {
      std::mt19937 random(seed);
      for (int i = 0; i < 5000; ++i) {
        const TileKey key{0, {20, std::uint32_t(random() % 300), 0}, 0};
        if (const auto found = cache.find(key)) {
          ASSERT_EQ(found->body(), std::to_string(key.tile.x) + std::string(500, '.'));
        } else {
          cache.insert(key, tile_of(std::to_string(key.tile.x) + std::string(500, '.')));
        }
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_LE(cache.bytes(), std::size_t(1 << 18));
}

}  // namespace
}  // namespace tind::services
