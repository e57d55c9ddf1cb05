#include "terrain/pyramid/plan/line_scale.h"

#include "terrain/surface/post_warp.h"

namespace tind {

LineScale line_scale(const TilePlan& plan, int z) {
  constexpr double kLeast = 4;
  const LevelPlan& level = plan.level(z);
  const double unit = tiling::tile_degrees(z) / kTileExtent;
  return {.least_deg = kLeast * level.line_tolerance * unit,
          .relief_m = level.fit_error_m / 2,
          .finest_deg = kLeast * unit,
          .step_m = level.border_step_m};
}

}  // namespace tind
