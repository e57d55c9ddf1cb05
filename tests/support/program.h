#pragma once
// The program as its users run it, for tests of subcommands.

#include <string>

namespace tind::test {

/// Sanitizers multiply what a program takes: what it takes says nothing then.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

struct Ran {
  int code = -1;    ///< the exit code
  std::string out;  ///< stdout and stderr together
};

/// Runs this build's `tind` through the shell: "info a.tif --json".
Ran run_tind(const std::string& arguments);

}  // namespace tind::test
