#pragma once
// Simplifies a DEM: one function for all methods.

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/options.h"

namespace tind {

/// Simplifies the terrain mesh of `dem`; lengths and circumradii are in metres. Voids are left out:
/// a triangle with a void corner is not part of the input mesh. GUARANTEES: every triangle
/// counter-clockwise with positive area, every valid post that the input mesh covers still covered;
/// may stop short, and `note` says why.
Result<Simplified> simplify(const Terrain& dem, const SimplifyOptions& options,
                            const Progress& progress = {});

}  // namespace tind
