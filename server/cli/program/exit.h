#pragma once
// How a command ends: exit codes, and what it says on stderr.

#include <string>

#include "terrain/base/result.h"

namespace tind::cli {

/// Shell exit codes (sysexits where one fits), the same for every subcommand.
enum Exit : int {
  kOk = 0,
  kInternal = 1,
  kUsage = 2,           // wrong arguments
  kBadData = 65,        // an input is corrupt or not what it says
  kSourceMissing = 69,  // an input cannot be opened
  kCannotCreate = 73,   // an output cannot be created, which is tried before the work
  kIo = 74,             // reading or writing failed on the way: a broken or a full disk
  kTryAgain = 75,       // stopped by a signal: run again to go on
};

/// The one table from what went wrong to how the program ends. kCannotCreate is not in it: that is
/// what check_outputs() and check_output_folder() (output_paths.h) find before the work; a write
/// that fails later is kIo.
Exit exit_code(Errc);

/// Prints "tind: what" on stderr and returns the exit code. Bytes of file names that would speak to
/// the terminal are printed as \xNN, here and wherever else messages are printed.
int complain(const Error&);
/// Prints "tind: warning: what" on stderr.
void warn(const std::string& what);
/// Prints "tind: what" on stderr: nothing is wrong, but it should be known.
void note(const std::string& what);

}  // namespace tind::cli
