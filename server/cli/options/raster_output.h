#pragma once
// A mesh of a DEM as rasters on the DEM's own grid.

#include <string>

#include "server/cli/program/command_line.h"
#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/raster_file.h"

namespace tind::cli {

struct RasterOutput {
  std::string heights, errors;  // paths; empty: not asked for
  bool any() const { return !heights.empty() || !errors.empty(); }
};

/// Fails (invalid_argument) where another raster's CRS lies beside a path at which one without a
/// CRS is to be: readers would take it for its own. To be asked before long work.
Result<void> can_lie_there(const std::string& path, const DemInfo&);
/// Writes a raster and, where it has its CRS in a file of its own, that.
Result<void> write_raster(const std::string& path, const RasterBytes&);

/// --raster and --error-raster.
void add_raster_output(Command, RasterOutput&);

/// What can be refused before any work: other extensions; and, once the DEM is open,
/// places that the format cannot say. (check_outputs refuses the DEM itself.)
Result<void> check(const RasterOutput&);
Result<void> check(const RasterOutput&, const DemInfo&);

/// `mesh` in post coordinates; `posts` gives the DEM's rows, strips of 256 in order, once for each
/// raster. kOk, or says what is wrong and returns its exit code.
int write_rasters(const RasterOutput&, const DemInfo&, const Tin& mesh, const RasterRows& posts,
                  int threads);

}  // namespace tind::cli
