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

}  // namespace
}  // namespace tind::logging
