#include "server/services/work/cpu_pool.h"

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
    return [this](const std::stop_token&) {
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
      auto permit = pool.admit(Work::tile);
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
  EXPECT_EQ(pool.capacity(Work::tile), 5u);
  for (int i = 0; i < 5; ++i) {
    auto permit = pool.admit(Work::tile);
    ASSERT_TRUE(permit) << i;
    pool.run(std::move(*permit), gate.task());
  }
  gate.wait_for(2);
  const auto refused = pool.admit(Work::tile);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::busy);
  gate.open.set_value();
  while (pool.admitted() > 0) std::this_thread::yield();
  EXPECT_TRUE(pool.admit(Work::tile));
}

TEST(CpuPool, WhoWaitsForOthersKeepsNobodyOffTheCores) {
  Gate tiles, fetches, question;
  CpuPool pool(1, 100);
  const auto run = [&](Work work, Gate& gate, int n) {
    for (int i = 0; i < n; ++i) {
      auto permit = pool.admit(work);
      ASSERT_TRUE(permit);
      pool.run(std::move(*permit), gate.task());
    }
  };
  // All cores have work, and yet so many are asked for as there are threads to wait for them.
  run(Work::tile, tiles, 2);
  tiles.wait_for(1);
  run(Work::fetch, fetches, int(CpuPool::kFetches) + 3);
  fetches.wait_for(int(CpuPool::kFetches));
  // All of those wait, and the cores are free for others.
  run(Work::question, question, 1);
  question.wait_for(1);
  EXPECT_EQ(fetches.running, int(CpuPool::kFetches));
  for (Gate* gate : {&tiles, &fetches, &question}) gate->open.set_value();
  while (pool.admitted() > 0) std::this_thread::yield();
  EXPECT_EQ(fetches.running, int(CpuPool::kFetches) + 3);
}

TEST(CpuPool, APermitThatIsNotUsedIsGivenBack) {
  CpuPool pool(1, 0);
  { const auto permit = pool.admit(Work::tile); }
  EXPECT_EQ(pool.admitted(), 0u);
  EXPECT_TRUE(pool.admit(Work::tile));
}

TEST(CpuPool, ATaskThatThrowsGivesItsPlaceBack) {
  CpuPool pool(1, 0);
  for (int i = 0; i < 3; ++i) {
    while (pool.admitted() > 0) std::this_thread::yield();
    auto permit = pool.admit(Work::tile);
    ASSERT_TRUE(permit);
    pool.run(std::move(*permit), [](std::stop_token) { throw std::runtime_error("on purpose"); });
  }
}

TEST(CpuPool, StopTellsTheRunningAndDropsTheWaiting) {
  CpuPool pool(1, 10);
  std::atomic<bool> running{false}, told{false}, ran{false};
  const auto dropped = std::make_shared<int>();
  auto first = pool.admit(Work::tile);
  pool.run(std::move(*first), [&](std::stop_token stop) {
    running = true;
    while (!stop.stop_requested()) std::this_thread::yield();
    told = true;
  });
  while (!running) std::this_thread::yield();
  auto second = pool.admit(Work::tile);
  pool.run(std::move(*second), [&, dropped](std::stop_token) { ran = true; });
  EXPECT_EQ(dropped.use_count(), 2);
  pool.stop();
  EXPECT_TRUE(told);
  EXPECT_FALSE(ran);
  EXPECT_EQ(dropped.use_count(), 1) << "destroyed, so that its destructor can answer";
  auto late = pool.admit(Work::tile);
  ASSERT_TRUE(late);
  pool.run(std::move(*late), [&](std::stop_token) { ran = true; });
  EXPECT_FALSE(ran);
  EXPECT_EQ(pool.admitted(), 0u);
}

void add(CpuPool& pool, Work work, CpuPool::Task task, std::stop_token gone = {},
         std::string client = {}) {
  auto permit = pool.admit(work, std::move(client));
  ASSERT_TRUE(permit);
  pool.run(std::move(*permit), std::move(task), std::move(gone));
}

TEST(CpuPool, BatchesNeverHoldAllWorkers) {
  for (const int threads : {1, 2, 3}) {
    Gate batches, tiles;
    CpuPool pool(threads, 80);
    for (int i = 0; i < 10; ++i) add(pool, Work::batch, batches.task());
    for (int i = 0; i < threads - threads / 2; ++i) add(pool, Work::tile, tiles.task());
    tiles.wait_for(std::max(1, threads - 1));
    batches.wait_for(1);
    tiles.open.set_value();
    while (pool.admitted(Work::tile) > 0) std::this_thread::yield();
    EXPECT_EQ(batches.running, 1) << threads << " threads: the other nine wait their turn";
    EXPECT_EQ(pool.admitted(Work::batch), 10u);
    batches.open.set_value();
    while (pool.admitted() > 0) std::this_thread::yield();
  }
}

TEST(CpuPool, BatchesHaveAQueueOfTheirOwn) {
  Gate gate;
  CpuPool pool(2, 16);
  for (int i = 0; i < 3; ++i) add(pool, Work::batch, gate.task());  // one runs, two wait
  EXPECT_EQ(pool.admit(Work::batch).error().code, Errc::busy);
  EXPECT_EQ(pool.refused(Work::batch), 1u);
  EXPECT_TRUE(pool.admit(Work::tile));
  EXPECT_TRUE(pool.admit(Work::question));
  gate.open.set_value();
}

TEST(CpuPool, ClassesTakeTurns) {
  Gate gate;
  CpuPool pool(2, 100);
  for (int i = 0; i < 2; ++i) add(pool, Work::tile, gate.task());
  gate.wait_for(2);
  std::atomic<int> tiles{0}, tiles_before_the_last_question{0};
  for (int i = 0; i < 60; ++i) add(pool, Work::tile, [&](const std::stop_token&) { ++tiles; });
  for (int i = 0; i < 3; ++i)
    add(pool, Work::question,
        [&](const std::stop_token&) { tiles_before_the_last_question = tiles.load(); });
  gate.open.set_value();
  while (pool.admitted() > 0) std::this_thread::yield();
  EXPECT_EQ(tiles, 60);
  EXPECT_LT(tiles_before_the_last_question, 50) << "sixty came first";
}

TEST(CpuPool, ClientsTakeTurns) {
  Gate gate;
  CpuPool pool(1, 100);
  add(pool, Work::tile, gate.task());
  gate.wait_for(1);
  std::string order;  // one worker does tiles
  const auto ask = [&](char client, int n) {
    for (int i = 0; i < n; ++i)
      add(pool, Work::tile, [&order, client](const std::stop_token&) { order += client; }, {},
          {client});
  };
  ask('a', 50);
  ask('b', 1);
  ask('c', 3);
  gate.open.set_value();
  while (pool.admitted() > 0) std::this_thread::yield();
  EXPECT_EQ(order, "abcacac" + std::string(47, 'a'));
}

TEST(CpuPool, OneClientNeverHasAllPlaces) {
  Gate gate;
  CpuPool pool(2, 14);
  for (int i = 0; i < 12; ++i) add(pool, Work::tile, gate.task(), {}, "greedy");
  EXPECT_EQ(pool.admit(Work::tile, "greedy").error().code, Errc::busy);
  EXPECT_EQ(pool.refused(Work::tile), 1u);
  {
    const auto first = pool.admit(Work::tile, "modest"), second = pool.admit(Work::tile),
               third = pool.admit(Work::tile), fourth = pool.admit(Work::tile);
    EXPECT_TRUE(first && second && third && fourth) << "nobody in particular may have the rest";
    EXPECT_FALSE(pool.admit(Work::tile, "late"));
  }
  gate.open.set_value();
  while (pool.admitted() > 0) std::this_thread::yield();
  for (int i = 0; i < 12; ++i)
    add(
        pool, Work::tile, [](const std::stop_token&) {}, {}, "greedy");
}

TEST(CpuPool, AFewGreedyClientsNeverHaveAllPlacesEither) {
  Gate gate;
  CpuPool pool(2, 98);
  for (const std::string client : {"a", "b", "c", "d", "e", "f", "g", "h"}) {
    const std::size_t before = pool.admitted();
    for (;;) {
      auto permit = pool.admit(Work::tile, client);
      if (!permit) break;
      pool.run(std::move(*permit), gate.task());
    }
    EXPECT_GT(pool.admitted(), before) << client;
  }
  EXPECT_GE(pool.admitted(), 88u) << "but little is idle";
  std::vector<CpuPool::Permit> modest;
  for (int i = 0; i < 6; ++i) {
    auto permit = pool.admit(Work::tile, "modest " + std::to_string(i));
    ASSERT_TRUE(permit) << i;
    modest.push_back(std::move(*permit));
  }
  gate.open.set_value();
}

TEST(CpuPool, ASmallQueueIsNotTooSmallForOneWhoAsksAgain) {
  Gate gate;
  CpuPool pool(2, 1);  // of batches one runs and one waits
  EXPECT_EQ(pool.capacity(Work::batch), 2u);
  for (int i = 0; i < 2; ++i) add(pool, Work::batch, gate.task(), {}, "the only one");
  gate.open.set_value();
}

TEST(CpuPool, NoQueueIsAQueueOfOne) {
  Gate gate;
  CpuPool pool(1, 0);
  for (int i = 0; i < 2; ++i) add(pool, Work::tile, gate.task(), {}, "the only one");
  EXPECT_FALSE(pool.admit(Work::tile));
  gate.open.set_value();
}

TEST(CpuPool, PlacesOfTheDeadAreTheirClientsAgain) {
  Gate gate;
  CpuPool pool(1, 15);
  add(pool, Work::tile, gate.task(), {}, "a");
  gate.wait_for(1);
  std::stop_source gone;
  for (int i = 0; i < 11; ++i)
    add(
        pool, Work::tile, [](const std::stop_token&) {}, gone.get_token(), "a");
  EXPECT_FALSE(pool.admit(Work::tile, "a"));
  gone.request_stop();
  EXPECT_TRUE(pool.admit(Work::tile, "a"));
  gate.open.set_value();
}

TEST(CpuPool, WhatNobodyWantsIsNotBegun) {
  Gate gate;
  CpuPool pool(1, 10);
  add(pool, Work::tile, gate.task());
  gate.wait_for(1);
  std::stop_source gone;
  std::atomic<int> ran{0};
  const auto kept = std::make_shared<int>();
  add(
      pool, Work::tile, [&, kept](const std::stop_token&) { ++ran; }, gone.get_token());
  add(pool, Work::tile, [&](const std::stop_token&) { ran += 100; });
  gone.request_stop();
  gate.open.set_value();
  while (pool.admitted() > 0) std::this_thread::yield();
  EXPECT_EQ(ran, 100);
  EXPECT_EQ(kept.use_count(), 1) << "destroyed, so that its destructor can answer";
  EXPECT_EQ(pool.abandoned(Work::tile), 1u);
}

TEST(CpuPool, TheDeadMakeRoomForTheLiving) {
  Gate gate;
  CpuPool pool(1, 1);
  add(pool, Work::tile, gate.task());
  gate.wait_for(1);
  std::stop_source gone;
  add(
      pool, Work::tile, [](const std::stop_token&) {}, gone.get_token());
  EXPECT_FALSE(pool.admit(Work::tile));
  gone.request_stop();
  EXPECT_TRUE(pool.admit(Work::tile));
  gate.open.set_value();
}

TEST(CpuPool, WhatRunsIsToldThatNobodyWantsIt) {
  CpuPool pool(1, 1);
  std::stop_source gone;
  std::atomic<bool> running{false}, told{false};
  add(
      pool, Work::batch,
      [&](const std::stop_token& stop) {
        running = true;
        while (!stop.stop_requested()) std::this_thread::yield();
        told = true;
      },
      gone.get_token());
  while (!running) std::this_thread::yield();
  gone.request_stop();
  while (pool.admitted() > 0) std::this_thread::yield();
  EXPECT_TRUE(told);
  EXPECT_EQ(pool.abandoned(Work::batch), 1u);
}

}  // namespace
}  // namespace tind::services
