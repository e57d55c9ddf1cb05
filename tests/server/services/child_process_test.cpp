#include "server/services/jobs/child_process.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <csignal>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/in_process.h"
#include "tests/support/support.h"

namespace tind::services {
namespace {

ChildEnd run(const std::string& script) {
  const test::TempDir folder;
  const std::vector<std::string> words = {"/bin/sh", "-c", script};
  const auto end = run_child(words, folder.path().string(), {}, {}, {});
  EXPECT_TRUE(end) << end.error().what;
  return end.value_or(ChildEnd{});
}

TEST(ChildProcess, SaysHowItEnded) {
  EXPECT_EQ(run("exit 0").why, ChildEnd::Why::exited);
  EXPECT_EQ(run("exit 0").code, 0);
  EXPECT_EQ(run("exit 65").code, 65);
  const ChildEnd killed = run("kill -KILL $$");
  EXPECT_EQ(killed.why, ChildEnd::Why::killed);
  EXPECT_EQ(killed.code, SIGKILL);
}

/// Where somebody has said that nobody asks how children end, the system forgets it.
TEST(ChildProcess, AnEndThatNobodyKnowsIsNoSuccess) {
  const auto before = std::signal(SIGCHLD, SIG_IGN);
  const ChildEnd good = run("exit 0"), bad = run("exit 65"), killed = run("kill -KILL $$");
  std::signal(SIGCHLD, before);
  for (const ChildEnd& end : {good, bad, killed})
    EXPECT_FALSE(end.why == ChildEnd::Why::exited && end.code == 0);
}

TEST(ChildProcess, IsNotBegunWithoutItsLimitsAndSaysSo) {
  const std::string said = test::in_process([]() -> std::string {
    if (!test::forbid_limits()) return "no filter";
    std::string heard;
    const std::vector<std::string> words = {"/bin/sh", "-c", "echo begun >&2"};
    const auto end = run_child(words, "/", {.memory_bytes = 1u << 30},
                               [&](std::string_view line) { heard += line; }, {});
    return end && end->why == ChildEnd::Why::exited && end->code != 0 ? heard : "no end";
  });
  if (said == "no filter") GTEST_SKIP() << "this system has no seccomp filters";
  EXPECT_NE(said.find("no limits can be set"), std::string::npos) << said;
  EXPECT_EQ(said.find("begun"), std::string::npos) << said;
}

/// SIGXCPU says why, SIGKILL can be anybody's: it comes first also where the system's limit is
/// lower than ours.
TEST(ChildProcess, OfTooMuchTimeItIsToldSoUnderALowerLimitToo) {
  const std::string said = test::in_process([]() -> std::string {
    const rlimit lower{3, 3};
    if (::setrlimit(RLIMIT_CPU, &lower) != 0) return "no limit";
    const std::vector<std::string> words = {"/bin/sh", "-c", "while :; do :; done"};
    const auto end = run_child(words, "/", {.cpu_time = std::chrono::seconds(100)}, {}, {});
    return end && end->why == ChildEnd::Why::killed && end->code == SIGXCPU ? "SIGXCPU" : "another";
  });
  EXPECT_EQ(said, "SIGXCPU");
}

}  // namespace
}  // namespace tind::services
