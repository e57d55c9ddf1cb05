#pragma once
// One entry point for every way of simplifying a DEM.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/height_grid.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

/// Simplifies the terrain mesh of `grid`. Post spacing is in metres, so that lengths and
/// circumradii make sense. Voids are left out: a triangle with a void corner is not part of the
/// input mesh. GUARANTEES: every triangle counter-clockwise with positive area, every valid post
/// that the input mesh covers still covered; may stop short, and `note` says why.
Result<Simplified> simplify(const HeightGrid& grid, double spacing_x_m, double spacing_y_m,
                            const SimplifyOptions& options, const Progress& progress = {});

}  // namespace tind
