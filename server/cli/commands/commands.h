#pragma once
// The subcommands of `tind`: one file each, one function each, which adds the subcommand to the
// program and, when it is chosen, runs it and stores its exit code.

#include <string>

#include "server/cli/program/command_line.h"
#include "server/cli/program/exit.h"

namespace tind::cli {

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
void add_contours(Command program, int& exit);
void add_derivatives(Command program, int& exit);
void add_profile(Command program, int& exit);
void add_line_of_sight(Command program, int& exit);
void add_viewshed(Command program, int& exit);
void add_relief(Command program, int& exit);
void add_volume(Command program, int& exit);
void add_statistics(Command program, int& exit);
void add_difference(Command program, int& exit);
void add_methods(Command program, int& exit);
void add_formats(Command program, int& exit);
void add_key(Command program, int& exit);
void add_info(Command program, int& exit);
void add_build(Command program, int& exit);
void add_check(Command program, int& exit);
void add_verify(Command program, int& exit);
void add_copy(Command program, int& exit);
void add_estimate(Command program, int& exit);
void add_elevation(Command program, int& exit);
void add_export(Command program, int& exit);
void add_explain(Command program, int& exit);
void add_plan(Command program, int& exit);
void add_plan_build(Command program, int& exit);
void add_merge(Command program, int& exit);
void add_status(Command program, int& exit);
void add_serve(Command program, int& exit);

}  // namespace tind::cli
