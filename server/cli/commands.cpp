#include "server/cli/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <numeric>
#include <utility>
#include <vector>

#include "proto/file_io.h"

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

Exit exit_code(Errc code) {
  switch (code) {
    case Errc::invalid_argument:
    case Errc::out_of_range:
      return kUsage;
    case Errc::bad_data:
    case Errc::unsupported:
      return kBadData;
    case Errc::not_found:
      return kSourceMissing;
    case Errc::io:
      return kIo;
    case Errc::busy:
    case Errc::cancelled:
      return kTryAgain;
    case Errc::internal:
      return kInternal;
  }
  return kInternal;
}

int check_outputs(std::initializer_list<std::string> paths) {
  for (const std::string& path : paths) {
    if (path.empty()) continue;
    if (const auto ok = proto::can_write_file(path); !ok) {
      complain({Errc::io, ok.error()});
      return kCannotCreate;
    }
  }
  return kOk;
}

int complain(const Error& error) {
  std::fprintf(stderr, "tind: %s\n", printable(error.what).c_str());
  return exit_code(error.code);
}

void warn(const std::string& what) {
  std::fprintf(stderr, "tind: warning: %s\n", printable(what).c_str());
}

std::string printable(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    // U+0080 to U+009F, 0xC2 0x80 to 0xC2 0x9F, speak to terminals, too.
    const bool c1 = c == 0xc2 && i + 1 < text.size() &&
                    (static_cast<unsigned char>(text[i + 1]) & 0xe0) == 0x80;
    if (c < 0x20 || c == 0x7f || c1)
      out += fmt::format("\\x{:02x}", c);
    else
      out += text[i];
    if (c1) out += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[++i]));
  }
  return out;
}

}  // namespace tind::cli
