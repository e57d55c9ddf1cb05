#include "server/log/log.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <csignal>
#include <thread>

namespace tind::logging {
namespace {

struct Pipe {
  Pipe() { EXPECT_EQ(::pipe2(ends, O_CLOEXEC), 0); }
  ~Pipe() {
    ::close(ends[0]);
    ::close(ends[1]);
  }
  /// All that is in it.
  std::string read() const {
    ::fcntl(ends[0], F_SETFL, O_NONBLOCK);
    std::string text(1 << 20, '\0');
    const ssize_t size = ::read(ends[0], text.data(), text.size());
    text.resize(std::size_t(std::max<ssize_t>(size, 0)));
    return text;
  }
  int ends[2];
};

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (auto at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++found;
  return found;
}

TEST(LogTest, WritesLinesWithoutControlBytes) {
  const Pipe pipe;
  {
    const Log log("info", pipe.ends[1]);
    spdlog::info("a\x1b[31m b\nc \x7f \xc2\x9b d \xc3\xbc");
    spdlog::debug("not this");
  }
  const std::string text = pipe.read();
  EXPECT_NE(text.find(" info a\\x1b[31m b\\x0ac \\x7f \\xc2\\x9b d \xc3\xbc\n"), text.npos) << text;
  EXPECT_EQ(count(text, "\n"), 1u);
}

TEST(LogTest, SaysTheSameAFewTimesAndThenHowOften) {
  const Pipe pipe;
  const auto before = log_counts().repeated;
  {
    const Log log("info", pipe.ends[1]);
    for (int i = 0; i < 1000; ++i) spdlog::error("a tile is damaged request={}", i);
    for (int i = 0; i < 20; ++i) spdlog::info("GET / 200");
    spdlog::error("something else");
  }
  const std::string text = pipe.read();
  EXPECT_EQ(count(text, "a tile is damaged request="), 5u);
  EXPECT_EQ(count(text, "a tile is damaged (repeated 995 times)"), 1u) << text;
  EXPECT_EQ(count(text, "GET / 200"), 20u) << "an access log repeats itself rightly";
  EXPECT_EQ(count(text, "something else"), 1u);
  EXPECT_EQ(log_counts().repeated - before, 995u);
}

TEST(LogTest, ManyDifferentTextsAreBoundedToo) {
  const Pipe pipe;
  {
    const Log log("info", pipe.ends[1]);
    for (int i = 0; i < 100'000; ++i) spdlog::error("tile {} is damaged", i);
  }
  EXPECT_LT(count(pipe.read(), "\n"), 300u);
}

TEST(LogTest, AReaderThatReadsNothingCostsLinesOnly) {
  const Pipe pipe;
  const auto before = log_counts().dropped;
  {
    const Log log("info", pipe.ends[1]);
    for (int i = 0; i < 100'000; ++i) spdlog::info("line {} {}", i, std::string(100, 'x'));
  }  // which does not wait for it, either
  EXPECT_GT(log_counts().dropped - before, 80'000u);
  EXPECT_EQ(pipe.read().find("line 0 ") == std::string::npos, false);
}

TEST(LogTest, SaysHowManyLinesAreMissing) {
  const Pipe pipe;
  const Log log("info", pipe.ends[1]);
  for (int i = 0; i < 20'000; ++i) spdlog::info("line {} {}", i, std::string(100, 'x'));
  std::string text;
  while (text.find("lines of the log are missing here") == text.npos) {
    text += pipe.read();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

TEST(LogTest, GoesOnWithoutAReader) {
  std::signal(SIGPIPE, SIG_IGN);
  Pipe pipe;
  const auto before = log_counts().dropped;
  {
    const Log log("info", pipe.ends[1]);
    ::close(pipe.ends[0]);
    pipe.ends[0] = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    for (int i = 0; i < 10; ++i) spdlog::info("nobody reads this");
  }
  EXPECT_EQ(log_counts().dropped - before, 10u);
}

}  // namespace
}  // namespace tind::logging
