#include "tests/support/program.h"

#include <sys/wait.h>

#include <array>
#include <cstdio>

namespace tind::test {

Ran run_tind(const std::string& arguments) {
  const std::string command = std::string(TIND_BINARY) + " " + arguments + " 2>&1";
  Ran ran;
  FILE* const pipe = popen(command.c_str(), "r");
  std::array<char, 4096> part;
  for (std::size_t n; (n = fread(part.data(), 1, part.size(), pipe)) > 0;)
    ran.out.append(part.data(), n);
  ran.code = WEXITSTATUS(pclose(pipe));
  return ran;
}

}  // namespace tind::test
