#pragma once
// The options that many subcommands share about what they print and write.

#include <string>

#include "server/cli/program/command_line.h"
#include "terrain/mesh/mesh_frame.h"

namespace tind::cli {

/// --frame: where x and y of a written mesh are counted from.
void add_frame_option(Command, MeshFrame& frame);

/// --progress auto|bar|lines|none (progress_bar.h).
void add_progress_option(Command, std::string& progress);

/// --json, for the figures.
void add_json_flag(Command, bool& json);

}  // namespace tind::cli
