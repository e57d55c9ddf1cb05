#pragma once
// The options with which build, serve and estimate shape a tile pyramid.

#include <CLI/App.hpp>
#include <string>

#include "terrain/pyramid/tileset.h"

namespace tind::cli {

/// --levels A-B (or A), bound to both.
void add_levels_option(CLI::App&, const std::string& meaning, int& first, int& last);

/// --max-error, --error-factor, --levels A-B, --effort; bound to `options`.
void add_tile_options(CLI::App&, TileSetOptions& options);

}  // namespace tind::cli
