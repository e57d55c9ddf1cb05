#include "tests/support/program.h"

#include <sys/wait.h>

#include <array>
#include <cstdio>

namespace tind::test {

namespace {

std::string rest_of(std::FILE* file) {
  std::string text;
  std::array<char, 4096> part;
  for (std::size_t n; (n = fread(part.data(), 1, part.size(), file)) > 0;)
    text.append(part.data(), n);
  return text;
}

}  // namespace

Ran run_tind(const std::string& arguments, const std::string& before) {
  const TempDir folder;
  const std::string errors = folder.file("stderr");
  const std::string command = before + " " + TIND_BINARY + " " + arguments + " 2>'" + errors + "'";
  Ran ran;
  std::FILE* const pipe = popen(command.c_str(), "r");
  ran.answer = rest_of(pipe);
  ran.code = WEXITSTATUS(pclose(pipe));
  ran.out = ran.answer;
  if (std::FILE* const file = std::fopen(errors.c_str(), "r")) {
    ran.out += rest_of(file);
    std::fclose(file);
  }
  return ran;
}

std::string tind_binary() { return TIND_BINARY; }

}  // namespace tind::test
