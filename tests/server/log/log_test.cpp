#include "server/log/log.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <thread>
#include <vector>

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
    const Log log("info", Form::text, pipe.ends[1]);
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
    const Log log("info", Form::text, pipe.ends[1]);
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
  const auto begin = std::chrono::steady_clock::now();
  {
    const Log log("info", Form::text, pipe.ends[1]);
    for (int i = 0; i < 100'000; ++i) spdlog::error("tile {} is damaged", i);
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  EXPECT_LT(double(count(pipe.read(), "\n")), 300 * (1 + took.count())) << "so many a second";
}

TEST(LogTest, AReaderThatReadsNothingCostsLinesOnly) {
  const Pipe pipe;
  const auto before = log_counts().dropped;
  {
    const Log log("info", Form::text, pipe.ends[1]);
    for (int i = 0; i < 100'000; ++i) spdlog::info("line {} {}", i, std::string(100, 'x'));
  }  // which does not wait for it, either
  EXPECT_GT(log_counts().dropped - before, 80'000u);
  EXPECT_EQ(pipe.read().find("line 0 ") == std::string::npos, false);
}

TEST(LogTest, SaysHowManyLinesAreMissing) {
  const Pipe pipe;
  const Log log("info", Form::text, pipe.ends[1]);
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
    const Log log("info", Form::text, pipe.ends[1]);
    ::close(pipe.ends[0]);
    pipe.ends[0] = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    for (int i = 0; i < 10; ++i) spdlog::info("nobody reads this");
  }
  EXPECT_EQ(log_counts().dropped - before, 10u);
}

std::vector<nlohmann::json> objects(const std::string& text) {
  std::vector<nlohmann::json> all;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) all.push_back(nlohmann::json::parse(line));
  return all;
}

TEST(LogTest, AsJsonEachLineIsAnObject) {
  const Pipe pipe;
  {
    const Log log("info", Form::json, pipe.ends[1]);
    spdlog::warn("a \"name\"\nwith \x1b \xc2\x9b \xff and \xc3\xbc");
    spdlog::error("500 /tiles: it is torn request=ab12 (3 more were not logged)");
    spdlog::debug("not this");
  }
  const std::string text = pipe.read();
  EXPECT_EQ(text.find_first_not_of("\n", text.find_last_not_of("\n") + 1), text.npos);
  for (const char c : text) EXPECT_TRUE(c == '\n' || (c >= 0x20 && c < 0x7f)) << int(c);
  const auto lines = objects(text);
  ASSERT_EQ(lines.size(), 2u) << text;
  EXPECT_EQ(lines[0]["level"], "warning");
  EXPECT_EQ(lines[0]["message"], "a \"name\"\nwith \x1b \xc2\x9b \xef\xbf\xbd and \xc3\xbc");
  EXPECT_TRUE(
      std::regex_match(lines[0]["time"].get<std::string>(),
                       std::regex(R"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}[+-]\d\d:\d\d)")));
  EXPECT_FALSE(lines[0].contains("request"));
  EXPECT_EQ(lines[1]["message"], "500 /tiles: it is torn (3 more were not logged)");
  EXPECT_EQ(lines[1]["request"], "ab12");
}

TEST(LogTest, ARequestIsALineOrAnObject) {
  const Access access{.method = "GET",
                      .target = "/tiles/a b",
                      .refused = {},
                      .status = 404,
                      .bytes = 120,
                      .milliseconds = 1.23456,
                      .client = "127.0.0.1",
                      .request = "ab12"};
  const Access refused{.method = {},
                       .target = {},
                       .refused = "bad_target",
                       .status = 400,
                       .bytes = 7,
                       .milliseconds = 0,
                       .client = "::1"};
  const Pipe pipe;
  {
    const Log log("info", Form::text, pipe.ends[1]);
    log_access(access);
    log_access(refused);
  }
  {
    const Log log("info", Form::json, pipe.ends[1]);
    log_access(access);
    log_access(refused);
  }
  {
    const Log log("warn", Form::json, pipe.ends[1]);
    log_access(access);
  }
  const std::string text = pipe.read();
  EXPECT_NE(text.find(" info GET /tiles/a b 404 120 1.235 ms 127.0.0.1 request=ab12\n"), text.npos)
      << text;
  EXPECT_NE(text.find(" info refused: bad_target 400 7 0.000 ms ::1\n"), text.npos) << text;
  const auto lines = objects(text.substr(text.find('{')));
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0]["method"], "GET");
  EXPECT_EQ(lines[0]["target"], "/tiles/a b");
  EXPECT_EQ(lines[0]["status"], 404);
  EXPECT_EQ(lines[0]["bytes"], 120);
  EXPECT_EQ(lines[0]["milliseconds"], 1.235);
  EXPECT_EQ(lines[0]["client"], "127.0.0.1");
  EXPECT_EQ(lines[0]["request"], "ab12");
  EXPECT_EQ(lines[0]["message"], "GET /tiles/a b 404 120 1.235 ms 127.0.0.1");
  EXPECT_EQ(lines[1]["refused"], "bad_target");
  EXPECT_FALSE(lines[1].contains("method"));
  EXPECT_FALSE(lines[1].contains("request"));
}

}  // namespace
}  // namespace tind::logging
