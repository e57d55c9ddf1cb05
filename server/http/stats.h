#pragma once
// What the HTTP side counts. One per I/O thread, so that counting never makes two cores share a
// cache line; summed when somebody asks.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace tind::http {

/// Upper bounds in seconds of the request duration histogram; the last bucket has none.
inline constexpr std::array<double, 13> kDurationBounds = {
    0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10};

/// The sum over all threads.
struct StatsSnapshot {
  std::array<std::uint64_t, 6> by_class{};                            // [2]: 2xx
  std::array<std::uint64_t, kDurationBounds.size() + 1> durations{};  // not cumulative
  double duration_sum_s = 0;
  std::uint64_t connections = 0, accepted = 0, bytes_sent = 0;
  std::uint64_t held_bytes = 0, held_limit = 0;   // of request bodies and responses on their way
  std::map<std::string, std::uint64_t> rejected;  // by the label of the refusal
};

/// Written by one thread, read by any.
class Stats {
 public:
  void count_reply(int status, double seconds) {
    add(by_class_[std::size_t(status / 100) % by_class_.size()], 1);
    std::size_t bucket = 0;
    while (bucket < kDurationBounds.size() && seconds > kDurationBounds[bucket]) ++bucket;
    add(durations_[bucket], 1);
    add(nanoseconds_, std::uint64_t(seconds * 1e9));
  }
  void count_accepted() { add(accepted_, 1); }
  void count_sent(std::size_t bytes) { add(bytes_sent_, bytes); }
  void count_rejected(const char* label) {
    const std::lock_guard lock(mutex_);
    ++rejected_[label];
  }

  void add_to(StatsSnapshot& sum) const {
    for (std::size_t i = 0; i < by_class_.size(); ++i) sum.by_class[i] += get(by_class_[i]);
    for (std::size_t i = 0; i < durations_.size(); ++i) sum.durations[i] += get(durations_[i]);
    sum.duration_sum_s += double(get(nanoseconds_)) * 1e-9;
    sum.accepted += get(accepted_);
    sum.bytes_sent += get(bytes_sent_);
    const std::lock_guard lock(mutex_);
    for (const auto& [label, count] : rejected_) sum.rejected[label] += count;
  }

 private:
  using Counter = std::atomic<std::uint64_t>;
  // One writer: a plain load and store is enough, and cheaper than a locked add.
  static void add(Counter& counter, std::uint64_t n) {
    counter.store(counter.load(std::memory_order_relaxed) + n, std::memory_order_relaxed);
  }
  static std::uint64_t get(const Counter& counter) {
    return counter.load(std::memory_order_relaxed);
  }

  std::array<Counter, 6> by_class_{};
  std::array<Counter, kDurationBounds.size() + 1> durations_{};
  Counter nanoseconds_{0}, accepted_{0}, bytes_sent_{0};
  mutable std::mutex mutex_;  // refusals only
  std::map<std::string, std::uint64_t> rejected_;
};

}  // namespace tind::http
