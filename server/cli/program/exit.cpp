#include "server/cli/program/exit.h"

#include <cstdio>

#include "server/log/printable.h"

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

int complain(const Error& error) {
  std::fprintf(stderr, "tind: %s\n", logging::printable(error.what).c_str());
  return exit_code(error.code);
}

void warn(const std::string& what) {
  std::fprintf(stderr, "tind: warning: %s\n", logging::printable(what).c_str());
}

void note(const std::string& what) {
  std::fprintf(stderr, "tind: %s\n", logging::printable(what).c_str());
}

}  // namespace tind::cli
