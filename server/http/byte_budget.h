#pragma once
// One limit for all bytes that the server holds for single clients: request bodies, responses made
// for one client, and what clients that read slowly keep from being forgotten.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>

#include "server/http/message/reply.h"

namespace tind::http {

/// Thread-safe. What was taken is given back by whoever took it.
class ByteBudget {
 public:
  explicit ByteBudget(std::size_t limit) : limit_(limit) {}
  ByteBudget(const ByteBudget&) = delete;
  ByteBudget& operator=(const ByteBudget&) = delete;

  /// False, and nothing taken, when there is no room.
  bool take(std::size_t bytes);
  void give_back(std::size_t bytes) { held_.fetch_sub(bytes, std::memory_order_relaxed); }

  /// The same for a payload, which counts once however many connections pin it.
  bool pin(const Payload&);
  void unpin(const Payload&);

  std::size_t held() const { return held_.load(std::memory_order_relaxed); }
  std::size_t limit() const { return limit_; }

 private:
  const std::size_t limit_;
  std::atomic<std::size_t> held_{0};
  std::mutex pins_;  // guards Payload::pins
};

}  // namespace tind::http
