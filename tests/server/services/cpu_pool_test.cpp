#include "server/services/cpu_pool.h"

#include <gtest/gtest.h>

#include <future>
#include <thread>

namespace tind::services {
namespace {

/// A task that says that it runs, and then waits to be let go.
struct Gate {
  std::promise<void> open;
  std::shared_future<void> opened{open.get_future()};
  std::atomic<int> running{0};

  CpuPool::Task task() {
    return [this](std::stop_token) {
      ++running;
      opened.wait();
    };
  }
  void wait_for(int n) const {
    while (running < n) std::this_thread::yield();
  }
};

TEST(CpuPool, RunsWhatItAdmits) {
  std::atomic<int> ran{0};
  {
    CpuPool pool(2, 100);
    for (int i = 0; i < 50; ++i) {
      auto permit = pool.admit();
      ASSERT_TRUE(permit);
      pool.run(std::move(*permit), [&](std::stop_token) { ++ran; });
    }
    while (pool.admitted() > 0) std::this_thread::yield();
  }
  EXPECT_EQ(ran, 50);
}

TEST(CpuPool, RefusesWhatDoesNotFit) {
  Gate gate;
  CpuPool pool(2, 3);
  EXPECT_EQ(pool.capacity(), 5u);
  for (int i = 0; i < 5; ++i) {
    auto permit = pool.admit();
    ASSERT_TRUE(permit) << i;
    pool.run(std::move(*permit), gate.task());
  }
  gate.wait_for(2);
  const auto refused = pool.admit();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::busy);
  gate.open.set_value();
  while (pool.admitted() > 0) std::this_thread::yield();
  EXPECT_TRUE(pool.admit());
}

TEST(CpuPool, APermitThatIsNotUsedIsGivenBack) {
  CpuPool pool(1, 0);
  { const auto permit = pool.admit(); }
  EXPECT_EQ(pool.admitted(), 0u);
  EXPECT_TRUE(pool.admit());
}

TEST(CpuPool, ATaskThatThrowsGivesItsPlaceBack) {
  CpuPool pool(1, 0);
  for (int i = 0; i < 3; ++i) {
    while (pool.admitted() > 0) std::this_thread::yield();
    auto permit = pool.admit();
    ASSERT_TRUE(permit);
    pool.run(std::move(*permit), [](std::stop_token) { throw std::runtime_error("on purpose"); });
  }
}

TEST(CpuPool, StopTellsTheRunningAndDropsTheWaiting) {
  CpuPool pool(1, 10);
  std::atomic<bool> running{false}, told{false}, ran{false};
  const auto dropped = std::make_shared<int>();
  auto first = pool.admit();
  pool.run(std::move(*first), [&](std::stop_token stop) {
    running = true;
    while (!stop.stop_requested()) std::this_thread::yield();
    told = true;
  });
  while (!running) std::this_thread::yield();
  auto second = pool.admit();
  pool.run(std::move(*second), [&, dropped](std::stop_token) { ran = true; });
  EXPECT_EQ(dropped.use_count(), 2);
  pool.stop();
  EXPECT_TRUE(told);
  EXPECT_FALSE(ran);
  EXPECT_EQ(dropped.use_count(), 1) << "destroyed, so that its destructor can answer";
  auto late = pool.admit();
  ASSERT_TRUE(late);
  pool.run(std::move(*late), [&](std::stop_token) { ran = true; });
  EXPECT_FALSE(ran);
  EXPECT_EQ(pool.admitted(), 0u);
}

}  // namespace
}  // namespace tind::services
