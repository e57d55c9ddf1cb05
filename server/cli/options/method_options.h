#pragma once
// The options that choose a method of simplification and tune it, for every subcommand that
// runs one.

#include "server/cli/program/command_line.h"
#include "terrain/base/result.h"
#include "terrain/simplify/common/options.h"

namespace tind::cli {

/// --method and what each method reads, --threads; not where to stop.
void add_method_options(Command, SimplifyOptions&);

/// Fails (invalid_argument) when there is no such method, or when an option was given that it does
/// not read.
Result<void> check_method_options(Command, const std::string& method);

}  // namespace tind::cli
