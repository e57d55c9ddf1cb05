#include "server/services/access/token_bucket.h"

#include <algorithm>
#include <cmath>

namespace tind::services {

Taken TokenBucket::take(const Rate& rate, Nanoseconds now) {
  const auto each = Nanoseconds(std::llround(1e9 / rate.per_second));
  const auto all = Nanoseconds(std::llround(rate.most_at_once() * double(each)));
  Nanoseconds full = full_at_.load(std::memory_order_relaxed);
  while (true) {
    const Nanoseconds next = std::max(full, now) + each;
    if (next - now > all) return {false, 0, next - now - all};
    if (full_at_.compare_exchange_weak(full, next, std::memory_order_relaxed))
      return {true, (all - (next - now)) / each, next - now};
  }
}

}  // namespace tind::services
