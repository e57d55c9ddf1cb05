#pragma once
// The options that choose a method of simplification and tune it, for every subcommand that runs
// one.

#include <CLI/App.hpp>

#include "terrain/simplify/simplify.h"

namespace tind::cli {

/// --method and what each method reads, --threads; not where to stop.
void add_method_options(CLI::App&, SimplifyOptions&);

}  // namespace tind::cli
