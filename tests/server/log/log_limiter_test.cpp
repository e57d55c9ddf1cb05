#include "server/log/log_limiter.h"

#include <gtest/gtest.h>

namespace tind::logging {
namespace {

using std::chrono::seconds;

TEST(LogLimiter, SaysTheSameOnceAPeriodAndHowOften) {
  LogLimiter limiter(seconds(5), 10);
  const LogLimiter::Clock::time_point start{};
  EXPECT_EQ(limiter.take("damaged", start), 0u);
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(limiter.take("damaged", start + seconds(i % 5)));
  EXPECT_EQ(limiter.take("another", start + seconds(1)), 0u);
  EXPECT_EQ(limiter.take("damaged", start + seconds(5)), 1000u);
  EXPECT_FALSE(limiter.take("damaged", start + seconds(6)));
  EXPECT_EQ(limiter.take("damaged", start + seconds(60)), 1u);
}

TEST(LogLimiter, IsBoundedHoweverManyCausesThereAre) {
  LogLimiter limiter(seconds(5), 10);
  const LogLimiter::Clock::time_point start{};
  int said = 0;
  for (int i = 0; i < 1000; ++i) said += limiter.take(std::to_string(i), start).has_value();
  EXPECT_EQ(said, 10);
  EXPECT_FALSE(limiter.take("0", start));
  EXPECT_EQ(limiter.take("new", start + seconds(6)), 991u) << "all that was not said";
}

TEST(LogLimiter, SaysTheFirstFewOfAPeriodAndForgetsThemWhenItIsOver) {
  LogLimiter limiter(seconds(10), 2, 3);
  const LogLimiter::Clock::time_point start{};
  int said = 0;
  for (int i = 0; i < 8; ++i) said += limiter.take("damaged", start + seconds(i)).has_value();
  EXPECT_EQ(said, 3);
  EXPECT_EQ(limiter.take("once", start + seconds(5)), 0u);
  EXPECT_FALSE(limiter.take("no room", start + seconds(5)));
  EXPECT_TRUE(limiter.forget(start + seconds(9)).empty());
  const auto over = limiter.forget(start + seconds(10));
  ASSERT_EQ(over.size(), 2u);
  EXPECT_EQ(over[0].cause, "damaged");
  EXPECT_EQ(over[0].times, 5u);
  EXPECT_EQ(over[1].cause, "");
  EXPECT_EQ(over[1].times, 1u);
  EXPECT_EQ(limiter.take("damaged", start + seconds(11)), 0u) << "a new period";
  EXPECT_TRUE(limiter.forget(start + seconds(15)).empty())
      << "`once` was said whenever it happened";
  EXPECT_EQ(limiter.take("third", start + seconds(16)), 0u) << "which has made room";
}

}  // namespace
}  // namespace tind::logging
