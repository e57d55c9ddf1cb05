#pragma once
// --breaklines, --flatten, --boundary, --line-heights: the options, reading them, and what is
// reported of them.

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "server/cli/program/command_line.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/terrain.h"
#include "terrain/shapes/shape_files.h"
#include "terrain/simplify/constraints/constraints.h"
#include "terrain/surface/surface.h"

namespace tind::cli {

struct LineInput {
  std::vector<std::string> breaklines, flatten, boundary;  // files
  std::string heights = "line";                            // or dem: whose heights lines have
  bool any() const { return !(breaklines.empty() && flatten.empty() && boundary.empty()); }
};

void add_line_options(Command, LineInput&);

/// The same and --water for tiles: --breaklines, --flatten, --boundary, --water, --line-heights.
void add_shape_options(Command, ShapeFiles&);

/// A surface with the lines and the water of files, and on stderr what became of them.
Result<Surface> with_shapes(Surface, const ShapeFiles&);

/// The files' shapes over `posts`, which are all of `dem`, and more breaklines. Says on stderr
/// which files have only zeros for heights, where the DEM is not at sea level. Fails where a file
/// says that its heights, which count, are above another datum than the DEM's (compare_datums).
Result<std::shared_ptr<const Constraints>> read_lines(const LineInput&, const DemSource& dem,
                                                      const Terrain& posts,
                                                      std::vector<VectorLine> more = {});

nlohmann::ordered_json lines_json(const ConstraintReport&, const ConstraintCheck&);
std::string lines_text(const ConstraintReport&, const ConstraintCheck&);

}  // namespace tind::cli
