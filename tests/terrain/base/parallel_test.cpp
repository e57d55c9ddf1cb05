// The loop over several threads, and what becomes of it where there are none to be had.

#include "terrain/base/parallel.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <cstdlib>
#include <stdexcept>
#include <vector>

namespace tind {
namespace {

TEST(ParallelFor, DoesEachOnce) {
  for (const int threads : {0, 1, 3, 64}) {
    std::vector<std::atomic<int>> done(1000);
    parallel_for(done.size(), threads, [&](std::size_t i) { ++done[i]; });
    for (const auto& times : done) ASSERT_EQ(times, 1);
  }
  parallel_for(0, 4, [](std::size_t) { FAIL(); });
}

TEST(ParallelFor, RethrowsWhatABodyThrew) {
  EXPECT_THROW(parallel_for(100, 4,
                            [](std::size_t i) {
                              if (i == 7) throw std::runtime_error("7");
                            }),
               std::runtime_error);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // they need room of their own
[[noreturn]] void do_all_without_room() {
  rlimit no_room{};
  no_room.rlim_cur = no_room.rlim_max = 64 << 20;  // a thread has a stack of 8 MB
  if (setrlimit(RLIMIT_AS, &no_room) != 0) std::_Exit(2);
  std::atomic<int> sum = 0;
  parallel_for(1000, 64, [&](std::size_t) { ++sum; });
  std::_Exit(sum == 1000 ? 0 : 1);
}

TEST(ParallelFor, WithoutRoomForMoreThreadsFewerDoItAll) {
  EXPECT_EXIT(do_all_without_room(), testing::ExitedWithCode(0), "");
}
#endif

}  // namespace
}  // namespace tind
