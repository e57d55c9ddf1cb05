#pragma once
// The program as its users run it, for tests of subcommands.

#include <string>

#include "tests/support/support.h"

namespace tind::test {

struct Ran {
  int code = -1;       ///< the exit code
  std::string out;     ///< stdout and stderr, one after the other
  std::string answer;  ///< stdout alone: on a slow machine progress shows on stderr
};

/// Runs this build's `tind` through the shell: "info a.tif --json". `before`: what stands before
/// the program there, "HOME=/nowhere" or "ulimit -v 1000000;". Without it, the start is a fork of
/// one process that has loaded the program already (fork_server.cc): a third of the time.
Ran run_tind(const std::string& arguments, const std::string& before = {});

/// Where it is.
std::string tind_binary();

}  // namespace tind::test
