#include "server/http/timer_wheel.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <new>
#include <random>
#include <vector>

namespace tind::http {
namespace {

using std::chrono::milliseconds;

struct Bell : TimerWheel::Timer {
  int rung = 0;
  void on_deadline() override { ++rung; }
};

const TimerWheel::Clock::time_point kStart{};

TEST(TimerWheel, RingsOnceAfterItsTime) {
  TimerWheel wheel(kStart);
  Bell bell;
  wheel.set(bell, kStart, milliseconds(1000));
  wheel.advance(kStart + milliseconds(999));
  EXPECT_EQ(bell.rung, 0);
  wheel.advance(kStart + milliseconds(1200));
  EXPECT_EQ(bell.rung, 1);
  wheel.advance(kStart + milliseconds(500'000));
  EXPECT_EQ(bell.rung, 1);
}

TEST(TimerWheel, OneThatThrowsCostsTheOthersNothing) {
  struct Thrower : TimerWheel::Timer {
    void on_deadline() override { throw std::bad_alloc(); }
  };
  TimerWheel wheel(kStart);
  std::array<Bell, 3> bells;
  std::array<Thrower, 2> throwers;
  for (std::size_t i = 0; i < 3; ++i) {
    wheel.set(bells[i], kStart, milliseconds(1000));
    if (i < 2) wheel.set(throwers[i], kStart, milliseconds(1000));
  }
  auto now = kStart + milliseconds(1200);
  for (int i = 0; i < 2; ++i) EXPECT_THROW(wheel.advance(now), std::bad_alloc);
  wheel.advance(now);
  for (const Bell& bell : bells) EXPECT_EQ(bell.rung, 1);
}

TEST(TimerWheel, CanBeMovedAndCancelled) {
  TimerWheel wheel(kStart);
  Bell moved, cancelled, gone;
  wheel.set(moved, kStart, milliseconds(1000));
  wheel.set(moved, kStart, milliseconds(5000));
  wheel.set(cancelled, kStart, milliseconds(1000));
  TimerWheel::cancel(cancelled);
  {
    Bell temporary;
    wheel.set(temporary, kStart, milliseconds(1000));
  }
  wheel.advance(kStart + milliseconds(4000));
  EXPECT_EQ(moved.rung, 0);
  wheel.advance(kStart + milliseconds(6000));
  EXPECT_EQ(moved.rung, 1);
  EXPECT_EQ(cancelled.rung, 0);
}

TEST(TimerWheel, GoesAroundForLongDeadlinesAndLongSleeps) {
  TimerWheel wheel(kStart);
  Bell far;
  wheel.set(far, kStart, milliseconds(400'000));
  for (int t = 0; t <= 399'000; t += 10'000) wheel.advance(kStart + milliseconds(t));
  EXPECT_EQ(far.rung, 0);
  wheel.advance(kStart + milliseconds(10'000'000));
  EXPECT_EQ(far.rung, 1);
}

struct Snooze : TimerWheel::Timer {
  TimerWheel* wheel;
  TimerWheel::Clock::time_point now;
  int rung = 0;
  void on_deadline() override {
    ++rung;
    wheel->set(*this, now, milliseconds(102'400));  // the very slot that is being emptied
  }
};

TEST(TimerWheel, MayBeSetAgainWhileRinging) {
  TimerWheel wheel(kStart);
  Snooze snooze;
  snooze.wheel = &wheel;
  snooze.now = kStart + milliseconds(200);
  wheel.set(snooze, kStart, milliseconds(100));
  wheel.advance(snooze.now);
  EXPECT_EQ(snooze.rung, 1);
}

TEST(TimerWheel, NeverEarlyNeverMuchLate) {
  std::mt19937 random(7);
  TimerWheel wheel(kStart);
  struct Due : Bell {
    milliseconds at{};
  };
  std::vector<std::unique_ptr<Due>> bells;
  for (int now = 0; now < 300'000; now += 50) {
    const auto time = kStart + milliseconds(now);
    wheel.advance(time);
    for (const auto& bell : bells) {
      if (milliseconds(now) < bell->at) {
        ASSERT_EQ(bell->rung, 0);
      }
      if (milliseconds(now) >= bell->at + milliseconds(250)) {
        ASSERT_EQ(bell->rung, 1);
      }
    }
    if (now % 1000 == 0) {
      const milliseconds after(random() % 150'000);
      bells.push_back(std::make_unique<Due>());
      bells.back()->at = milliseconds(now) + after;
      wheel.set(*bells.back(), time, after);
    }
  }
}

}  // namespace
}  // namespace tind::http
