#include "terrain/base/lru.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

namespace tind {
namespace {

using Cache = Lru<int, std::string>;

std::vector<int> keys(const Cache::Entries& entries) {
  std::vector<int> keys;
  for (const auto& entry : entries) keys.push_back(entry.key);
  return keys;
}

TEST(Lru, counts_where_no_weight_is_given) {
  Cache cache(2);
  EXPECT_TRUE(cache.insert(1, "a").empty());
  EXPECT_TRUE(cache.insert(2, "b").empty());
  EXPECT_EQ(keys(cache.insert(3, "c")), std::vector{1});
  EXPECT_EQ(cache.find(1), nullptr);
  EXPECT_EQ(*cache.find(2), "b");
  EXPECT_EQ(cache.size(), 2u);
}

TEST(Lru, what_is_taken_out_weighs_nothing_any_more) {
  Cache cache(3);
  for (int i = 1; i <= 3; ++i) cache.insert(i, "a");
  EXPECT_EQ(keys(cache.take_if([](int key) { return key != 2; })), (std::vector{3, 1}));
  EXPECT_EQ(cache.weight(), 1u);
  EXPECT_EQ(cache.find(1), nullptr);
  EXPECT_EQ(*cache.find(2), "a");
  EXPECT_TRUE(cache.insert(4, "b").empty());
  EXPECT_EQ(keys(cache.entries()), (std::vector{4, 2}));
}

TEST(Lru, a_find_is_a_use_and_a_peek_is_none) {
  Cache cache(2);
  cache.insert(1, "a");
  cache.insert(2, "b");
  EXPECT_EQ(*cache.peek(1), "a");
  EXPECT_EQ(keys(cache.entries()), (std::vector{2, 1}));
  EXPECT_EQ(*cache.find(1), "a");
  EXPECT_EQ(keys(cache.entries()), (std::vector{1, 2}));
  EXPECT_EQ(keys(cache.insert(3, "c")), std::vector{2});
  EXPECT_EQ(cache.peek(2), nullptr);
}

TEST(Lru, weights_are_bounded_and_as_many_go_as_must) {
  Cache cache(100);
  for (int i = 0; i < 5; ++i) cache.insert(i, "", 20);
  EXPECT_EQ(cache.weight(), 100u);
  EXPECT_EQ(keys(cache.insert(5, "", 50)), (std::vector{0, 1, 2}));
  EXPECT_EQ(cache.weight(), 90u);
  EXPECT_EQ(keys(cache.insert(6, "", 101)), (std::vector{3, 4, 5, 6})) << "it fits nowhere";
  EXPECT_EQ(cache.weight(), 0u);
}

TEST(Lru, some_stay_whatever_they_weigh) {
  Cache cache(100, 1);
  cache.insert(1, "", 10);
  EXPECT_EQ(keys(cache.insert(2, "", 1000)), std::vector{1});
  EXPECT_NE(cache.find(2), nullptr);
  EXPECT_EQ(keys(cache.insert(3, "", 1)), std::vector{2});
  EXPECT_EQ(cache.weight(), 1u);
}

TEST(Lru, a_second_value_takes_the_place_of_the_first) {
  Lru<int, std::string, std::hash<int>> cache(100);
  cache.insert(1, "a", 60);
  EXPECT_TRUE(cache.insert(1, "b", 70).empty()) << "what was replaced has not gone";
  EXPECT_EQ(*cache.find(1), "b");
  EXPECT_EQ(cache.weight(), 70u);
  EXPECT_EQ(cache.size(), 1u);
}

}  // namespace
}  // namespace tind
