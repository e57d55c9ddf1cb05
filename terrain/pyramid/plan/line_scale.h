#pragma once
// What a level of a pyramid asks of a dataset's lines.

#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/shapes/shape_lines.h"

namespace tind {

/// A function of the plan and the level alone, so that all tiles of a level have the same lines.
LineScale line_scale(const TilePlan&, int level);

}  // namespace tind
