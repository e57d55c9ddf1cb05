#pragma once
// Coarse deadlines for thousands of connections: setting one costs a few pointer writes, and none
// at all while it stays in the same tick. Not thread-safe: one wheel per I/O thread.

#include <array>
#include <chrono>
#include <cstdint>

namespace tind::http {

class TimerWheel {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kTick{100};

  /// A base class of what can time out.
  class Timer {
   public:
    virtual ~Timer() { unlink(); }
    Timer() = default;
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;

   protected:
    /// The deadline has passed (by up to two ticks); it is no longer set. May set another.
    virtual void on_deadline() = 0;

   private:
    friend class TimerWheel;
    void unlink() {
      if (!next_) return;
      next_->prev_ = prev_;
      prev_->next_ = next_;
      next_ = prev_ = nullptr;
    }
    Timer* next_ = nullptr;
    Timer* prev_ = nullptr;
    std::int64_t due_ = 0;  // tick
  };

  explicit TimerWheel(Clock::time_point now) : start_(now) {
    for (Head& head : slots_) head.next_ = head.prev_ = &head;
    due_.next_ = due_.prev_ = &due_;
  }
  ~TimerWheel() {
    for (Head& head : slots_) empty(head);
    empty(due_);
  }

  void set(Timer& timer, Clock::time_point now, std::chrono::milliseconds after) {
    const std::int64_t due = tick_of(now + after) + 1;
    if (timer.next_ && timer.due_ == due) return;
    timer.unlink();
    timer.due_ = due;
    link(timer);
  }
  static void cancel(Timer& timer) { timer.unlink(); }

  /// Calls on_deadline() of all that are due. When one throws, the rest are called the next time.
  void advance(Clock::time_point now) {
    const std::int64_t to = tick_of(now);
    if (to - at_ > std::int64_t(kSlots)) at_ = to - kSlots;  // after a long sleep: each slot once
    ring();
    while (at_ < to) {
      ++at_;
      Head& slot = slots_[at_ % kSlots];
      // Taken out first: what a deadline sets anew may land in this very slot, a turn later.
      while (slot.next_ != &slot) {
        Timer& timer = *slot.next_;
        timer.unlink();
        insert(due_, timer);
      }
      ring();
    }
  }

 private:
  static constexpr std::size_t kSlots = 1024;  // 102 s: longer deadlines just go around again
  struct Head : Timer {
    void on_deadline() override {}
  };

  void ring() {
    while (due_.next_ != &due_) {
      Timer& timer = *due_.next_;
      timer.unlink();
      if (timer.due_ <= at_) {
        timer.on_deadline();
      } else {
        link(timer);
      }
    }
  }
  static void empty(Head& head) {
    while (head.next_ != &head) head.next_->unlink();
    head.next_ = head.prev_ = nullptr;
  }
  std::int64_t tick_of(Clock::time_point time) const { return (time - start_) / kTick; }
  void link(Timer& timer) { insert(slots_[timer.due_ % kSlots], timer); }
  static void insert(Timer& head, Timer& timer) {
    timer.prev_ = head.prev_;
    timer.next_ = &head;
    head.prev_->next_ = &timer;
    head.prev_ = &timer;
  }

  Clock::time_point start_;
  std::int64_t at_ = 0;
  std::array<Head, kSlots> slots_;
  Head due_;  // taken out of their slot, not called yet
};

}  // namespace tind::http
