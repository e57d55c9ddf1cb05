#include "server/services/jobs/child_process.h"

#include <gtest/gtest.h>

#include <csignal>
#include <string>
#include <vector>

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

}  // namespace
}  // namespace tind::services
