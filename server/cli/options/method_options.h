#pragma once
// The options that choose a method of simplification and tune it, for every subcommand that runs
// one.

#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "server/cli/program/command_line.h"
#include "terrain/base/result.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/options.h"

namespace tind::cli {

/// What a line says of methods: which one, and the options of each, for the order on the line is
/// free. Bound to the line's options, so it stays where it is.
struct MethodLine {
  std::string name = method_name(MethodOptions{});
  std::vector<MethodOptions> all = all_methods();
  /// Of options that several methods have, each with words of its own: the word that was given.
  std::map<std::string, std::string> shared = {};
};

/// --method and what each method reads, --threads; not where to stop. --drape is left to commands
/// that know a DEM to lay it over. `without`: options that the command has no use for.
void add_method_options(Command, MethodLine&, int& threads,
                        std::initializer_list<std::string_view> without = {});

/// The same without --threads.
void add_method_choice(Command, MethodLine&, std::initializer_list<std::string_view> without = {});

/// The method that the line names, with its options. Fails (invalid_argument) when there is no such
/// method, or when an option was given that it does not read. `without`: options of methods that
/// the command has itself, for something else.
Result<MethodOptions> method_of(Command, const MethodLine&,
                                std::initializer_list<std::string_view> without = {});

}  // namespace tind::cli
