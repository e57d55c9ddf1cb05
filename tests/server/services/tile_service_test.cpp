#include "server/services/tiles/tile_service.h"

#include <gtest/gtest.h>

#include <future>

#include "tests/support/made_up_tiles.h"

namespace tind::services {
namespace {

class TileServiceTest : public ::testing::Test {
 protected:
  using Made = Result<TileService::Tile>;

  std::future<Made> ask(TileService& service, TileId id, proto::Extensions asked = kAll) {
    auto promise = std::make_shared<std::promise<Made>>();
    service.make(*dataset_, id, asked, [promise](Made made) { promise->set_value(made); });
    return promise->get_future();
  }

  static constexpr proto::Extensions kAll{true, true, true};
  std::shared_ptr<test::MadeUpTiles> made_up_ = std::make_shared<test::MadeUpTiles>();
  Catalog catalog_;
  const ServedDataset* dataset_ = &catalog_.add("made-up", dataset_of(made_up_));
  TileCache cache_{1 << 20};
};

TEST_F(TileServiceTest, BuildsOnceThenHits) {
  CpuPool pool(2, 10);
  TileService service(cache_, pool);
  EXPECT_EQ(service.cached(*dataset_, {3, 2, 1}, kAll), nullptr);
  const Made made = ask(service, {3, 2, 1}).get();
  ASSERT_TRUE(made);
  EXPECT_EQ(service.cached(*dataset_, {3, 2, 1}, kAll), *made);
  EXPECT_EQ(made_up_->built, 1);
  EXPECT_EQ(service.counters().hits, 1u);
}

TEST_F(TileServiceTest, HoweverManyAskThereIsOneBuild) {
  test::Gate gate(*made_up_);
  CpuPool pool(2, 10);
  TileService service(cache_, pool);
  std::vector<std::future<Made>> asked;
  for (int i = 0; i < 64; ++i) asked.push_back(ask(service, {3, 2, 1}));
  gate.open();
  for (auto& made : asked) EXPECT_TRUE(made.get());
  EXPECT_EQ(made_up_->built, 1);
  EXPECT_EQ(service.counters().joined, 63u);
}

TEST_F(TileServiceTest, VariantsComeFromTheOneBuild) {
  CpuPool pool(1, 10);
  TileService service(cache_, pool);
  const auto bytes = [](const Made& made) {
    const std::string_view body = (*made)->body();
    return std::vector<std::uint8_t>(body.begin(), body.end());
  };
  const auto whole = bytes(ask(service, {2, 1, 1}).get());
  const auto bare = bytes(ask(service, {2, 1, 1}, {}).get());
  const auto normals = bytes(ask(service, {2, 1, 1}, {true, false, false}).get());
  EXPECT_EQ(made_up_->built, 1);
  EXPECT_EQ(bare, proto::strip_extensions(whole, {}));
  EXPECT_LT(bare.size(), normals.size());
  EXPECT_LT(normals.size(), whole.size());
  // The water mask is not on offer: asking for it makes no other variant.
  EXPECT_NE(service.cached(*dataset_, {2, 1, 1}, {true, true, false}), nullptr);
  EXPECT_EQ(cache_.tiles(), 3u);
}

TEST_F(TileServiceTest, AFailureReachesAllAndIsForgotten) {
  test::Gate gate(*made_up_, Error{Errc::io, "the disk is on fire"});
  CpuPool pool(2, 10);
  TileService service(cache_, pool, std::chrono::milliseconds(0));
  std::vector<std::future<Made>> asked;
  for (int i = 0; i < 8; ++i) asked.push_back(ask(service, {3, 2, 1}));
  gate.open();
  for (auto& future : asked) {
    const Made made = future.get();
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, Errc::io);
  }
  EXPECT_EQ(cache_.tiles(), 0u);
  made_up_->before = nullptr;
  while (pool.admitted() > 0) std::this_thread::yield();
  EXPECT_TRUE(ask(service, {3, 2, 1}).get()) << "the next one may succeed";
}

TEST_F(TileServiceTest, WhatFailedIsNotTriedAgainAtOnce) {
  for (const Errc code : {Errc::bad_data, Errc::io, Errc::busy, Errc::cancelled}) {
    const int before = made_up_->built;
    made_up_->before = [&](TileId) { return Error{code, "no"}; };
    CpuPool pool(2, 10);
    TileService service(cache_, pool, std::chrono::hours(1));
    for (int i = 0; i < 5; ++i) {
      EXPECT_EQ(ask(service, {3, 2, 1}).get().error().code, code);
      EXPECT_EQ(service.make_now(*dataset_, {3, 2, 1}, kAll, {}).error().code, code);
    }
    const bool lasts = code == Errc::bad_data || code == Errc::io;
    EXPECT_EQ(made_up_->built - before, lasts ? 1 : 10) << int(code);
    EXPECT_EQ(service.counters().failed, lasts ? 1u : 0u);
    EXPECT_EQ(ask(service, {3, 2, 2}).get().error().code, code) << "another tile is asked for";
  }
}

TEST_F(TileServiceTest, WhatOneClientLeavesAnotherStillGets) {
  std::atomic<int> begun{0}, stopped{0};
  std::promise<void> gate;
  const auto opened = gate.get_future().share();
  CpuPool pool(2, 10);
  TileProducts products(
      cache_, pool, TileKey::kStream,
      [&](const ServedDataset&, TileId, const std::stop_token& stop) {
        ++begun;
        using namespace std::chrono_literals;
        while (!stop.stop_requested() && opened.wait_for(0s) != std::future_status::ready)
          std::this_thread::yield();
        if (stop.stop_requested()) {
          ++stopped;
          return Result<TileProducts::Product>(fail(Errc::cancelled, "stopped"));
        }
        return Result<TileProducts::Product>(
            http::Representation::make("made", {.content_type = "a/b"}));
      });
  const auto want = [&](const std::stop_source& client) {
    auto promise = std::make_shared<std::promise<Made>>();
    products.make(*dataset_, {3, 2, 1}, [promise](Made made) { promise->set_value(made); },
                  {client.get_token(), {}});
    return promise->get_future();
  };
  std::stop_source first, second, third;
  auto to_first = want(first), to_second = want(second);
  first.request_stop();
  while (begun < 1) std::this_thread::yield();
  EXPECT_EQ(stopped, 0) << "the second still wants it";
  second.request_stop();
  EXPECT_EQ(to_first.get().error().code, Errc::cancelled);
  EXPECT_EQ(to_second.get().error().code, Errc::cancelled);
  EXPECT_EQ(stopped, 1);
  EXPECT_EQ(products.counters().failed, 0u);
  // Who comes now begins anew, also while the abandoned one is still on its way out.
  auto to_third = want(third);
  gate.set_value();
  EXPECT_TRUE(to_third.get());
  EXPECT_EQ(begun, 2);
  third.request_stop();  // too late to matter
  pool.stop();
}

TEST_F(TileServiceTest, WhoHasGoneBeforeAskingIsAnsweredToo) {
  CpuPool pool(1, 10);
  TileService service(cache_, pool);
  std::stop_source gone;
  gone.request_stop();
  auto promise = std::make_shared<std::promise<Made>>();
  service.make(*dataset_, {3, 2, 1}, kAll, [promise](Made made) { promise->set_value(made); },
               {gone.get_token(), {}});
  EXPECT_EQ(promise->get_future().get().error().code, Errc::cancelled);
  EXPECT_EQ(made_up_->built, 0);
}

TEST_F(TileServiceTest, APeekIsNoUse) {
  CpuPool pool(1, 10);
  TileService service(cache_, pool);
  EXPECT_EQ(service.peek(*dataset_, {3, 2, 1}, kAll), nullptr);
  const Made made = ask(service, {3, 2, 1}).get();
  ASSERT_TRUE(made);
  EXPECT_EQ(service.peek(*dataset_, {3, 2, 1}, kAll), *made);
  EXPECT_EQ(service.counters().hits, 0u);
}

TEST_F(TileServiceTest, AnExceptionIsAFailure) {
  made_up_->before = [](TileId) -> std::optional<Error> { throw std::bad_alloc(); };
  CpuPool pool(1, 10);
  TileService service(cache_, pool);
  const Made made = ask(service, {0, 0, 0}).get();
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, Errc::busy);  // there may be memory again
  made_up_->before = [](TileId) -> std::optional<Error> { throw std::logic_error("a bug"); };
  EXPECT_EQ(ask(service, {0, 0, 0}).get().error().code, Errc::internal);
}

TEST_F(TileServiceTest, WhatDoesNotFitIsRefusedButMayJoin) {
  test::Gate gate(*made_up_);
  CpuPool pool(1, 1);
  TileService service(cache_, pool);
  auto running = ask(service, {3, 0, 0}), waiting = ask(service, {3, 1, 0});
  const Made refused = ask(service, {3, 2, 0}).get();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::busy);
  EXPECT_EQ(service.counters().refused, 1u);
  auto joined = ask(service, {3, 1, 0});
  gate.open();
  EXPECT_TRUE(running.get());
  EXPECT_TRUE(waiting.get());
  EXPECT_TRUE(joined.get());
}

TEST_F(TileServiceTest, StoppingAnswersThoseWhoWait) {
  std::atomic<bool> running{false};
  std::promise<void> gate;
  auto opened = gate.get_future().share();
  made_up_->before = [&](TileId) {
    running = true;
    opened.wait();
    return std::optional<Error>();
  };
  CpuPool pool(1, 10);
  TileService service(cache_, pool);
  auto first = ask(service, {3, 0, 0});
  while (!running) std::this_thread::yield();
  auto second = ask(service, {3, 1, 0});
  std::thread stopping([&] { pool.stop(); });
  const Made dropped = second.get();
  ASSERT_FALSE(dropped);
  EXPECT_EQ(dropped.error().code, Errc::cancelled);
  gate.set_value();
  EXPECT_TRUE(first.get());
  stopping.join();
}

TEST(Catalog, NumbersDuplicateNames) {
  Catalog catalog;
  const auto add = [&](const std::string& name) {
    return catalog.add(name, dataset_of(std::make_shared<test::MadeUpTiles>())).name;
  };
  EXPECT_EQ(add("alps"), "alps");
  EXPECT_EQ(add("alps"), "alps-2");
  EXPECT_EQ(add("alps"), "alps-3");
  EXPECT_EQ(add("a/b"), "a_b");
  EXPECT_EQ(add(std::string(80, 'x')), std::string(64, 'x'));
  EXPECT_EQ(add(std::string(80, 'x')), std::string(62, 'x') + "-2");
  EXPECT_EQ(catalog.find("alps-2")->index, 1u);
  EXPECT_EQ(catalog.find("none"), nullptr);
}

}  // namespace
}  // namespace tind::services
