#include "server/http/byte_budget.h"

namespace tind::http {

bool ByteBudget::take(std::size_t bytes) {
  std::size_t held = held_.load(std::memory_order_relaxed);
  while (bytes <= limit_ && held <= limit_ - bytes)
    if (held_.compare_exchange_weak(held, held + bytes, std::memory_order_relaxed)) return true;
  return false;
}

bool ByteBudget::pin(const Payload& payload) {
  const std::lock_guard lock(pins_);
  if (payload.pins == 0 && !take(payload.memory_bytes())) return false;
  ++payload.pins;
  return true;
}

void ByteBudget::unpin(const Payload& payload) {
  const std::lock_guard lock(pins_);
  if (--payload.pins == 0) give_back(payload.memory_bytes());
}

}  // namespace tind::http
