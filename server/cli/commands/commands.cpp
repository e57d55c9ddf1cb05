#include "server/cli/commands/commands.h"

#include "terrain/base/edit_distance.h"

namespace tind::cli {

std::string unknown_command(Command program, int argc, const char* const* argv) {
  if (argc < 2 || argv[1][0] == '-') return {};
  const std::string word = argv[1];
  std::string nearest;
  std::size_t least = 3;  // edits that still make a misspelling
  for (const std::string& name : program.subcommands()) {
    if (name == word) return {};
    const std::size_t n = edit_distance(word, name);
    if (n < least) least = n, nearest = name;
  }
  return "there is no command '" + word + "'; " +
         (nearest.empty() ? "'tind --help' lists them" : "did you mean " + nearest + "?");
}

}  // namespace tind::cli
