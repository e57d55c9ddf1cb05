// Memory may end anywhere: then the program says so and ends with an exit code. scripts/campaign
// --part memory goes through all allocations; here are some of the start and of the work.

#include <gtest/gtest.h>

#include "tests/support/program.h"
#include "tests/support/support.h"

namespace tind {
namespace {

TEST(Allocation, ThatFailsEndsTheProgramHonestly) {
  if (test::kSanitized) GTEST_SKIP() << "allocations are the sanitizer's";
  int failed = 0;
  for (const int n : {1, 50, 1265, 10000, 20000, 27604, 29000, 30000, 1 << 30}) {
    const auto ran =
        test::run_tind("info " + test::testdata("rainier.tif"),
                       "LD_PRELOAD=" TIND_FAILING_NEW " FAIL_NEW=" + std::to_string(n));
    if (ran.code == 0) continue;
    ++failed;
    EXPECT_EQ(ran.code, 75) << n << ": " << ran.out;
    EXPECT_NE(ran.out.find("tind: out of memory"), std::string::npos) << n << ": " << ran.out;
  }
  EXPECT_GE(failed, 5);
}

}  // namespace
}  // namespace tind
