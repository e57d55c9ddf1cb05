#include "server/http/byte_budget.h"

#include <new>

namespace tind::http {
namespace {

constexpr std::size_t kTimesTheRest = 3;  // one address may hold so many times what nobody does
constexpr std::size_t kReserve = 8;       // of all an eighth is for those who hold little:
constexpr std::size_t kLittle = 512;      // so small a part of all

}  // namespace

/// No memory for the book is no room either: whoever pinned a part could not let go of it behind an
/// exception.
bool ByteBudget::take_now(const Address& address, std::size_t bytes) try {
  if (bytes == 0) return true;
  if (bytes > limit_ - held_) return false;
  const auto found = holders_.find(address);
  const std::size_t mine = bytes + (found == holders_.end() ? 0 : found->second);
  const std::size_t rest = limit_ - held_ - bytes;
  if (mine > kTimesTheRest * rest) return false;
  if (mine > limit_ / kLittle && rest < limit_ / kReserve) return false;
  if (found != holders_.end())
    found->second = mine;
  else
    holders_.emplace(address, mine);
  held_ += bytes;
  return true;
} catch (const std::bad_alloc&) {
  return false;
}

void ByteBudget::give_back_now(const Address& address, std::size_t bytes) noexcept {
  if (bytes == 0) return;
  held_ -= bytes;
  const auto found = holders_.find(address);
  found->second -= bytes;
  if (found->second == 0) holders_.erase(found);
}

bool ByteBudget::take(const Address& address, std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  return take_now(address, bytes);
}

void ByteBudget::give_back(const Address& address, std::size_t bytes) noexcept {
  const std::lock_guard lock(mutex_);
  give_back_now(address, bytes);
}

bool ByteBudget::pin(const Address& address, const Payload& payload) try {
  const std::lock_guard lock(mutex_);
  const auto [at, first] = pins_.try_emplace(&payload, Pin{0, address});
  if (first && !take_now(address, payload.memory_bytes())) {
    pins_.erase(at);
    return false;
  }
  ++at->second.count;
  return true;
} catch (const std::bad_alloc&) {
  return false;
}

void ByteBudget::unpin(const Payload& payload) noexcept {
  const std::lock_guard lock(mutex_);
  const auto found = pins_.find(&payload);
  if (--found->second.count > 0) return;
  give_back_now(found->second.holder, payload.memory_bytes());
  pins_.erase(found);
}

std::size_t ByteBudget::held() const {
  const std::lock_guard lock(mutex_);
  return held_;
}

}  // namespace tind::http
