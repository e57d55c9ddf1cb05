// What a command prints arrives, or the command fails.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/program.h"

namespace tind {
namespace {

using test::run_tind;

TEST(Output, a_full_device_is_a_failure_of_every_command_that_prints) {
  const test::TempDir folder;
  const std::string dem = test::testdata("desert.asc"), tiles = folder.file("tiles");
  ASSERT_EQ(run_tind("build " + dem + " -o " + tiles + " --levels 0-3").code, 0);
  for (const std::string& command :
       std::vector<std::string>{"methods", "methods --json", "info " + dem, "info --json " + dem,
                                "check --json " + tiles, "check --rules",
                                "build --json " + dem + " -o " + tiles + " --levels 0-3",
                                "build " + dem + " -o " + tiles + " --levels 0-3",
                                "estimate --json " + dem + " --levels 0-3",
                                "explain --json " + tiles + " 3/2/5", "--help", "build --help"}) {
    const auto ran = run_tind(command + " > /dev/full");
    EXPECT_EQ(ran.code, 74) << command << ran.out;
    EXPECT_NE(ran.out.find("cannot write to standard output"), std::string::npos) << command;
  }
}

}  // namespace
}  // namespace tind
