#pragma once
// How often somebody may ask: a token bucket, kept as the one time at which it would be full again
// (the generic cell rate algorithm, ITU-T I.371). Exact: in any time t at most burst + rate * t
// requests pass.

#include <atomic>
#include <cstdint>

#include "server/services/access/keys.h"

namespace tind::services {

/// Since any moment that stays the same.
using Nanoseconds = std::int64_t;

struct Taken {
  bool passed = true;
  std::int64_t left = 0;  // requests that would pass now
  Nanoseconds again = 0;  // until the next one would; of one that passed: until all would
};

/// Thread-safe, without a lock.
class TokenBucket {
 public:
  /// REQUIRES: rate.per_second > 0, the same at each call.
  Taken take(const Rate&, Nanoseconds now);
  /// As if nobody had ever taken.
  bool is_full(Nanoseconds now) const { return full_at_.load(std::memory_order_relaxed) <= now; }

 private:
  std::atomic<Nanoseconds> full_at_{0};
};

}  // namespace tind::services
