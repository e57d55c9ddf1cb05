#include "terrain/base/keyed_hash.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <unordered_map>

namespace tind {
namespace {

TEST(KeyedHash, NumbersThatWereChosenDoNotShareABucket) {
  constexpr std::uint64_t kCount = 20'000;
  std::unordered_map<std::uint64_t, int, KeyedHash> table;
  table.reserve(kCount);
  const std::uint64_t buckets = table.bucket_count();
  for (std::uint64_t i = 1; i <= kCount; ++i) table.try_emplace(i * buckets);
  ASSERT_EQ(table.bucket_count(), buckets);
  std::size_t fullest = 0;
  for (std::size_t b = 0; b < buckets; ++b) fullest = std::max(fullest, table.bucket_size(b));
  EXPECT_LT(fullest, 20u);  // all of them where a number is its own hash
}

TEST(KeyedHash, IsTheSameForTheWholeProcess) {
  EXPECT_EQ(keyed_hash(7), keyed_hash(7));
  EXPECT_NE(keyed_hash(7), keyed_hash(8));
}

}  // namespace
}  // namespace tind
