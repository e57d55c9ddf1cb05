#pragma once
// A priority queue of edges without a heap: it sorts costs into buckets of 1/8 octave.
//
// A simplifier needs "the cheapest edge" hundreds of thousands of times, and each answer of a heap
// is a chain of cache misses. Greedy order does not need the last 9 % of precision. So a push
// appends to a bucket, and a bucket is handed out as a whole, in the order of the pushes. Edges are
// first pushed in mesh order, so a bucket runs over the terrain in one direction and stays in the
// cache.
//
// Lazy: raising a cost needs no call, because the caller evaluates each edge again when it takes it
// and pushes it back if necessary. Lowering a cost is another push; the older entry is skipped when
// its turn comes.

#include <bit>
#include <cstdint>
#include <vector>

namespace tind {

class BucketQueue {
 public:
  using Index = std::uint32_t;
  using Bucket = std::uint16_t;
  static constexpr Bucket kAbsent = 0xffff;
  static constexpr int kShift = 20;               // of a float's 23 mantissa bits, 3 remain
  static constexpr Bucket kBuckets = 0x07f8 + 1;  // up to infinity

  explicit BucketQueue(std::size_t slots) : bucket_(slots, kAbsent), entries_(kBuckets) {}

  /// Monotone in cost. REQUIRES: cost >= 0, not NaN.
  static Bucket bucket_of(float cost) {
    return Bucket(std::bit_cast<std::uint32_t>(cost + 0.0f) >> kShift);
  }

  /// Enters e, or moves it to a lower bucket; a higher one than it is in now is ignored.
  void push(Index e, Bucket b) {
    if (b >= bucket_[e]) return;
    bucket_[e] = b;
    entries_[b].push_back(e);
    if (b < lowest_) lowest_ = b;
  }

  [[gnu::always_inline]] void prefetch(Index e) const { __builtin_prefetch(&bucket_[e]); }
  bool in_bucket(Index e, Bucket b) const { return bucket_[e] == b; }
  bool queued(Index e) const { return bucket_[e] != kAbsent; }
  void forget(Index e) { bucket_[e] = kAbsent; }

  /// Moves all entries of the lowest bucket into `batch`; kAbsent when the queue is empty. The
  /// caller asks `take` for each entry in turn.
  Bucket next_batch(std::vector<Index>& batch) {
    batch.clear();
    while (lowest_ < kBuckets && entries_[lowest_].empty()) ++lowest_;
    if (lowest_ == kBuckets) return kAbsent;
    batch.swap(entries_[lowest_]);
    return lowest_;
  }

  /// Takes entry e of a batch out of the queue; false when it has moved to another bucket since.
  bool take(Index e, Bucket b) {
    if (bucket_[e] != b) return false;
    bucket_[e] = kAbsent;
    return true;
  }

 private:
  std::vector<Bucket> bucket_;  // per edge slot
  std::vector<std::vector<Index>> entries_;
  Bucket lowest_ = 0;
};

}  // namespace tind
