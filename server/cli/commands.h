#pragma once
// The subcommands of `tind`: one file each, one function each, which adds the subcommand to the
// program and, when it is chosen, runs it and stores its exit code.

#include <initializer_list>
#include <string>

#include "server/cli/command_line.h"
#include "terrain/base/result.h"

namespace tind::cli {

/// Shell exit codes (sysexits where one fits), the same for every subcommand.
enum Exit : int {
  kOk = 0,
  kInternal = 1,
  kUsage = 2,           // wrong arguments
  kBadData = 65,        // an input is corrupt or not what it says
  kSourceMissing = 69,  // an input cannot be opened
  kCannotCreate = 73,   // an output cannot be created
  kIo = 74,             // reading or writing failed on the way
  kTryAgain = 75,       // stopped by a signal: run again to go on
};

/// The one table from what went wrong to how the program ends.
Exit exit_code(Errc);

/// Prints "tind: what" on stderr and returns the exit code. Bytes of file names that would speak to
/// the terminal are printed as \xNN, here and wherever else messages are printed.
int complain(const Error&);
/// Prints "tind: warning: what" on stderr.
void warn(const std::string& what);
/// One line without control bytes.
std::string printable(const std::string& text);

/// For those of `paths` that are not empty: kOk when each can be written, else says why not and
/// returns kCannotCreate. Before long work, so that it is not lost.
int check_outputs(std::initializer_list<std::string> paths);

/// Empty when the first word is a subcommand or an option, or when there is none; else what is
/// wrong with it, with the name that comes nearest.
std::string unknown_command(Command program, int argc, const char* const* argv);

void add_simplify(Command program, int& exit);
void add_refine(Command program, int& exit);
void add_progressive(Command program, int& exit);
void add_extract(Command program, int& exit);
void add_between(Command program, int& exit);
void add_measure(Command program, int& exit);
void add_compare(Command program, int& exit);
void add_methods(Command program, int& exit);
void add_info(Command program, int& exit);
void add_build(Command program, int& exit);
void add_check(Command program, int& exit);
void add_estimate(Command program, int& exit);
void add_explain(Command program, int& exit);
void add_plan(Command program, int& exit);
void add_serve(Command program, int& exit);

}  // namespace tind::cli
