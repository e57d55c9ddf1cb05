#include "terrain/simplify/collapse/bucket_queue.h"

#include <gtest/gtest.h>

#include <random>

namespace tind {
namespace {

using Bucket = BucketQueue::Bucket;

std::vector<BucketQueue::Index> drain(BucketQueue& queue) {
  std::vector<BucketQueue::Index> out, batch;
  for (Bucket b; (b = queue.next_batch(batch)) != BucketQueue::kAbsent;)
    for (const auto e : batch)
      if (queue.take(e, b)) out.push_back(e);
  return out;
}

TEST(BucketQueue, BucketsAreMonotoneAndNarrow) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> exponent(-30, 30);
  for (int i = 0; i < 10000; ++i) {
    const float a = std::exp2(exponent(random)), b = std::exp2(exponent(random));
    if (a <= b) {
      EXPECT_LE(BucketQueue::bucket_of(a), BucketQueue::bucket_of(b));
    }
    if (b > a * 1.126f) {
      EXPECT_LT(BucketQueue::bucket_of(a), BucketQueue::bucket_of(b));
    }
  }
  EXPECT_EQ(BucketQueue::bucket_of(0.0f), BucketQueue::bucket_of(-0.0f));
}

TEST(BucketQueue, GivesOutAscendingBucketsFirstInFirstOut) {
  BucketQueue queue(6);
  const float costs[] = {5, 1, 5, 0, 1, 3e38f};
  for (std::uint32_t e = 0; e < 6; ++e) queue.push(e, BucketQueue::bucket_of(costs[e]));
  EXPECT_EQ(drain(queue), (std::vector<std::uint32_t>{3, 1, 4, 0, 2, 5}));
}

TEST(BucketQueue, LoweringMovesAndRaisingIsIgnored) {
  BucketQueue queue(3);
  for (std::uint32_t e = 0; e < 3; ++e) queue.push(e, BucketQueue::bucket_of(10));
  queue.push(2, BucketQueue::bucket_of(1));
  queue.push(0, BucketQueue::bucket_of(100));
  EXPECT_EQ(drain(queue), (std::vector<std::uint32_t>{2, 0, 1}));
  EXPECT_FALSE(queue.queued(0));
}

}  // namespace
}  // namespace tind
