#pragma once
// The options with which build, serve and estimate shape a tile pyramid.

#include <string>

#include "server/cli/options/method_options.h"
#include "server/cli/program/command_line.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/surface/surface.h"

namespace tind::cli {

/// --levels A-B (or A), bound to both.
void add_levels_option(Command, const std::string& meaning, int& first, int& last);

/// --max-error, --error-factor, --deepest, --levels A-B, --effort; bound to `options`.
void add_tile_options(Command, TileSetOptions& options);

/// --method and what the methods read; what of that is every tile's (--side, --effort) is in
/// add_tile_options.
void add_tile_method(Command, MethodLine&);

/// Into `options`, once the line is read. Fails (invalid_argument) for a method that makes no
/// tiles.
Result<void> set_tile_method(Command, const MethodLine&, TileSetOptions& options);

/// One line on stderr, where the pyramid is not what whoever asked for it may have
/// meant (TilePlan::warning).
void warn_of_plan(const Surface&, const TileSetOptions&);

}  // namespace tind::cli
