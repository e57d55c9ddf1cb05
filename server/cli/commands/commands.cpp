#include "server/cli/commands/commands.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace tind::cli {

namespace {

/// How many letters must be put in, left out or changed to make one word of the other.
std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i] != b[j]);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string unknown_command(Command program, int argc, const char* const* argv) {
  if (argc < 2 || argv[1][0] == '-') return {};
  const std::string word = argv[1];
  std::string nearest;
  std::size_t least = 3;  // edits that still make a misspelling
  for (const std::string& name : program.subcommands()) {
    if (name == word) return {};
    const std::size_t n = edits(word, name);
    if (n < least) least = n, nearest = name;
  }
  return "there is no command '" + word + "'; " +
         (nearest.empty() ? "'tind --help' lists them" : "did you mean " + nearest + "?");
}

}  // namespace tind::cli
