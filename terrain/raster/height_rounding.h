#pragma once
// How far heights in memory, which are floats, may lie from those of the source.

#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"

namespace tind {

/// Metres, over all valid posts of `heights`, which were read from that source; 0 where floats hold
/// its numbers. At most DemInfo::rounding_m, which holds for any height: less where all are low.
double height_rounding(const DemInfo&, const HeightGrid& heights);

}  // namespace tind
