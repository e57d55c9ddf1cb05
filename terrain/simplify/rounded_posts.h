#pragma once
// Bounds and sides that hold for the heights of a source whose posts in memory lie beside them by
// rounding (raster/height_rounding.h): methods know the posts in memory.

#include "terrain/mesh/tin.h"
#include "terrain/simplify/options.h"

namespace tind {

/// What to ask a method for, so that what was asked for holds; where a bound has no room for the
/// rounding, a small share of it.
StopAt within_rounding(const SimplifyOptions& asked, double rounding_m);
/// Has it? True where there is no bound.
bool has_room_for_rounding(const SimplifyOptions& asked, double rounding_m);

/// Lifts or lowers a mesh that is on one side of the posts in memory to that side of the source's;
/// within_rounding has left the room. Others stay as they are.
void keep_side(const SimplifyOptions& asked, double rounding_m, Tin&);

}  // namespace tind
