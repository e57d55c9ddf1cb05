// How the daemon ends, as whoever began it sees it.

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "tests/support/daemon_process.h"

namespace tind::test {
namespace {

/// From its last word until it is gone it takes a moment.
TEST(Stopping, ASignalMoreChangesNoExitCode) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    DaemonProcess daemon;
    ASSERT_TRUE(daemon.says("serving 1 datasets")) << daemon.said();
    daemon.hears(SIGTERM);
    ASSERT_TRUE(daemon.says("stopped")) << daemon.said();
    int status = 0;
    for (; !daemon.has_ended(status); std::this_thread::sleep_for(std::chrono::milliseconds(1)))
      daemon.hears(signal);
    EXPECT_TRUE(WIFEXITED(status)) << signal << " ended it";
    EXPECT_EQ(WEXITSTATUS(status), 0) << daemon.said();
  }
}

}  // namespace
}  // namespace tind::test
