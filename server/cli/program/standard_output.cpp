#include "server/cli/program/standard_output.h"

#include <cstdio>
#include <string_view>

namespace tind::cli {
namespace {

constexpr char kStdout[] = "/dev/stdout";
struct Named {
  std::string_view before;
  const char* whole;
};
constexpr Named kWhole[] = {{"--output=", "--output=/dev/stdout"},
                            {"--report=", "--report=/dev/stdout"}};

bool is_stdout(std::string_view path) {
  return path == "-" || path == kStdout || path == "/dev/fd/1" || path == "/proc/self/fd/1";
}

}  // namespace

std::vector<const char*> give_standard_output(int argc, const char* const* argv) {
  std::vector<const char*> line(argv, argv + argc);
  bool given = false;
  for (std::size_t i = 1; i < line.size(); ++i) {
    const std::string_view word = line[i], before = line[i - 1];
    if (word == "--") break;
    const char* instead = nullptr;
    for (const Named& option : kWhole)
      if (word.starts_with(option.before) && is_stdout(word.substr(option.before.size())))
        instead = option.whole;
    if ((before == "-o" || before == "--output" || before == "--report") && is_stdout(word))
      instead = kStdout;
    if (!instead) continue;
    line[i] = instead;
    given = true;
  }
  if (given) stdout = stderr;  // a variable in glibc and musl; the descriptor stays the output's
  return line;
}

}  // namespace tind::cli
