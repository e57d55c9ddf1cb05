#include "server/services/datasets/opener.h"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <string>

namespace tind::services {
namespace {

using namespace std::chrono_literals;

/// Fails with a text, once it is told to.
struct Slow {
  std::promise<void> begun, may_end;
  Opener::Open open(const std::string& text) {
    return [this, text]() -> Result<Dataset> {
      begun.set_value();
      may_end.get_future().wait();
      return fail(Errc::bad_data, text);
    };
  }
};

/// What came of it before is not what is there now.
TEST(Opener, WhatIsWantedAgainIsNotWhatWasDropped) {
  Slow before, again;
  Opener opener(2);
  opener.begin("a", before.open("before"));
  before.begun.get_future().wait();
  opener.keep({});
  opener.begin("a", again.open("again"));
  again.begun.get_future().wait();
  before.may_end.set_value();
  opener.wait_until(Opener::Clock::now() + 200ms);
  EXPECT_FALSE(opener.take("a"));
  again.may_end.set_value();
  opener.wait_until(Opener::Clock::now() + 60s);
  const auto done = opener.take("a");
  ASSERT_TRUE(done);
  ASSERT_FALSE(*done);
  EXPECT_EQ(done->error().what, "again");
}

}  // namespace
}  // namespace tind::services
