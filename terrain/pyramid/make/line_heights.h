#pragma once
// How high breaklines of a tile lie, and the vertices that they need for it.

#include "terrain/pyramid/make/tile_job.h"

namespace tind {

/// Gives a breakline the surface's heights, or its own as far as the level's error allows. Where
/// job.line_error_m asks for it, it gets vertices wherever it would else be farther from those
/// between two that it has: a long segment over hills is no edge of a mesh within its budget.
void give_heights(const TileJob&, TileLine&);

}  // namespace tind
