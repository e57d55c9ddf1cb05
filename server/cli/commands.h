#pragma once
// The subcommands of `tind`: one file each, one function each, which adds the subcommand to the
// program and, when it is chosen, runs it and stores its exit code.

#include <CLI/App.hpp>
#include <CLI/Config.hpp>     // whoever makes a subcommand emits
#include <CLI/Formatter.hpp>  // the tables of these two

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

/// Prints "tind: what" on stderr and returns the exit code.
int complain(const Error&);

void add_simplify(CLI::App& program, int& exit);
void add_refine(CLI::App& program, int& exit);
void add_progressive(CLI::App& program, int& exit);
void add_extract(CLI::App& program, int& exit);
void add_between(CLI::App& program, int& exit);
void add_measure(CLI::App& program, int& exit);
void add_compare(CLI::App& program, int& exit);
void add_methods(CLI::App& program, int& exit);
void add_info(CLI::App& program, int& exit);
void add_build(CLI::App& program, int& exit);
void add_check(CLI::App& program, int& exit);
void add_estimate(CLI::App& program, int& exit);
void add_explain(CLI::App& program, int& exit);
void add_plan(CLI::App& program, int& exit);
void add_serve(CLI::App& program, int& exit);

}  // namespace tind::cli
