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

/// Writes a raster and, where it has its CRS in a file of its own, that. Fails (invalid_argument)
/// where another one's lies there and this raster has none: readers would take it for this one's.
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
