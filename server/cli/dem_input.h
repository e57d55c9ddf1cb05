#pragma once
// The options with which every subcommand opens a DEM, and reading one as a whole.

#include <CLI/App.hpp>
#include <memory>
#include <string>
#include <vector>

#include "terrain/raster/dem_source.h"

namespace tind::cli {

/// What the user said about the input; bound to the options that `add_dem_options` adds.
struct DemInput {
  std::vector<std::string> files;
  std::string from_datum = "unknown", to_datum = "same";
  bool allow_vrt = false;
};

/// --from-datum, --to-datum, --allow-vrt.
void add_dem_options(CLI::App&, DemInput&);

DemOptions dem_options(const DemInput&);

Result<std::shared_ptr<const DemSource>> open_dem(const DemInput&);

/// All posts at once. Fails (out_of_range) for a source too large for one mesh.
Result<HeightGrid> read_all(const DemSource&);

}  // namespace tind::cli
