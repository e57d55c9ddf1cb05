#pragma once
// The options with which subcommands open what tiles are made of: one DEM, or layers of several.

#include <string>
#include <vector>

#include "server/cli/options/dem_input.h"
#include "server/cli/program/command_line.h"
#include "terrain/base/result.h"
#include "terrain/surface/open_surface.h"
#include "terrain/surface/surface.h"

namespace tind::cli {

/// What the user said about layers; bound to the options that `add_layer_options` adds.
struct SurfaceInput {
  std::vector<std::string> layers, blends, layer_errors, options;
};

/// --layer, --layer-option, --blend, --layer-error.
void add_layer_options(Command, SurfaceInput&);

/// Has the user named something to be opened?
bool names_any(const DemInput&, const SurfaceInput&);

/// What the options say, read: the layers, and what is said of all or of single ones.
struct SaidLayers {
  std::vector<LayerSpec> layers;
  SurfaceOptions options;
};
Result<SaidLayers> read_layers(const SurfaceInput&, const DemOptions&);

/// Of the files, or of the layers; with what should be known of it as warnings on stderr.
/// `options`: of the DEMs; else dem_options(input).
Result<Surface> open_surface(const DemInput&, const SurfaceInput&);
Result<Surface> open_surface(const DemInput&, const SurfaceInput&, const DemOptions& options);

/// Values among the posts that look like an undeclared nodata value.
void warn_of_nodata(const Surface&);

/// One line for each of several layers, the highest first: its name, spacing, blend and files.
/// Empty for one.
std::string layers_text(const Surface&);

}  // namespace tind::cli
