#pragma once
// The options that many subcommands share about what they print and write.

#include <CLI/App.hpp>
#include <string>

namespace tind::cli {

/// --frame source|metric: where x and y of a written mesh are counted from.
void add_frame_option(CLI::App&, std::string& frame);

/// --progress auto|bar|lines|none (progress_bar.h).
void add_progress_option(CLI::App&, std::string& progress);

/// --json, for the figures.
void add_json_flag(CLI::App&, bool& json);

}  // namespace tind::cli
