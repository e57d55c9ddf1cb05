#include "server/cli/program/exit.h"

#include <cstdio>

#include "server/log/printable.h"
#include "terrain/base/file_io.h"

namespace tind::cli {

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
    if (const auto ok = can_write_file(path); !ok) {
      complain(ok.error());
      return kCannotCreate;
    }
  }
  return kOk;
}

int complain(const Error& error) {
  std::fprintf(stderr, "tind: %s\n", logging::printable(error.what).c_str());
  return exit_code(error.code);
}

void warn(const std::string& what) {
  std::fprintf(stderr, "tind: warning: %s\n", logging::printable(what).c_str());
}

}  // namespace tind::cli
