#include "terrain/pyramid/plan/height_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "terrain/base/power_of_two.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/surface/tile_posts.h"
#include "terrain/surface/void_fill.h"

namespace tind {

namespace {

constexpr double kSmallestStep = 1.0 / 1024;
/// A float32 holds multiples of a step up to 2^24 of them; the highest one of a tile's 32767 steps
/// lies that much above its heights.
constexpr double kMostSteps = (1 << 24) - (1 << 15);
constexpr double kLargestStep = 1;  // metres; no reason to round heights more coarsely
/// What the coarsest step that there can be beside a tile may move its border, and more: half of
/// 32 m, which hold heights to kFarthestHeight_m.
constexpr double kMoved_m = 16;
static_assert(kStepReach >= VoidFill::kReach + 4, "a cell more, and the posts around its corners");

/// The heights that the surface can have in a rectangle and on its rim.
Result<std::pair<double, double>> heights_in(const DemSource& source, const GeoRect& rect,
                                             const std::stop_token& stop) {
  constexpr std::int64_t kRows = 256, kCols = 4096;
  std::vector<PostWindow> windows = post_windows(source, rect);
  const bool beside = windows.empty();
  if (beside) windows = windows_beside(source, rect, kStepReach);
  HeightRange range{HUGE_VAL, -HUGE_VAL, 0};
  std::uint64_t posts = 0;
  for (PostWindow& w : windows) {
    if (!beside) {
      w.col -= kStepReach, w.cols += 2 * kStepReach;
      w.row -= kStepReach, w.rows += 2 * kStepReach;
    }
    posts += std::uint64_t(w.cols) * std::uint64_t(w.rows);
    for (std::int64_t r = 0; r < w.rows; r += kRows)
      for (std::int64_t c = 0; c < w.cols; c += kCols) {
        if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
        const auto grid = source.read(w.col + c, w.row + r, int(std::min(kCols, w.cols - c)),
                                      int(std::min(kRows, w.rows - r)));
        if (!grid) return std::unexpected(grid.error());
        range.add(grid->values());
      }
  }
  if (auto ok = check_heights(source.info(), range.min_m, range.max_m); !ok)
    return std::unexpected(ok.error());
  // What fills voids, and what lies beside the data, slopes to 0.
  if (beside || range.valid < posts)
    range.min_m = std::min(range.min_m, 0.0), range.max_m = std::max(range.max_m, 0.0);
  return std::pair(range.min_m, range.max_m);
}

/// The step that a tile needs for itself, whatever is beside it.
Result<double> step_alone(const DemSource& source, const TilePlan& plan, TileId id,
                          const std::stop_token& stop) {
  if (plan.has_step_of_all(id)) return plan.step_of_all(id.level);
  if (const auto known = plan.step_memo().find(id)) return *known;
  const auto heights = heights_in(source, tiling::rect(id), stop);
  if (!heights) return std::unexpected(heights.error());
  const double step = height_step(plan.level(id.level), heights->first, heights->second);
  plan.step_memo().keep(id, step);
  return step;
}

HeightSteps one_step(double step) {
  HeightSteps steps;
  steps.own = step;
  steps.sides.fill(step);
  steps.ends.fill({step, step});
  return steps;
}

}  // namespace

Result<void> check_heights(const DemInfo& info, double low, double high) {
  if (!(low < -kFarthestHeight_m) && !(high > kFarthestHeight_m)) return {};
  return fail(Errc::bad_data,
              fmt::format("{}: a post is at {:g} m, which is no height of a planet: where it means "
                          "no data say --nodata VALUE, else state the unit of the heights with "
                          "gdal_edit.py",
                          info.files.front(), low < -kFarthestHeight_m ? low : high));
}

double finest_step(double farthest_m) {
  return std::max(kSmallestStep, power_of_two_at_least(farthest_m / kMostSteps));
}

double step_for(double error_m, double relief_m, double farthest_m) {
  return std::max({power_of_two_at_least(relief_m / 32767),
                   std::clamp(power_of_two_at_most(error_m / 16), kSmallestStep, kLargestStep),
                   finest_step(farthest_m)});
}

double height_step(const LevelPlan& level, double low, double high) {
  // Half a band beyond either, and as much again for borders.
  const double beyond = 4 * (level.fit_error_m + std::abs(level.offset_m)) + 2 * kMoved_m;
  return step_for(level.fit_error_m, high - low + beyond,
                  std::max(std::abs(low), std::abs(high)) + beyond);
}

Result<HeightSteps> height_steps(const Surface& surface, const TilePlan& plan, TileId id,
                                 std::stop_token stop) {
  if (!plan.local_steps()) {
    // Of layers all tiles of a level have one.
    HeightSteps steps = one_step(plan.level(id).border_step_m);
    for (const TileSide side : {TileSide::west, TileSide::south, TileSide::east, TileSide::north}) {
      const double step = plan.level(id, side).border_step_m;
      steps.sides[std::size_t(side)] = step, steps.ends[std::size_t(side)] = {step, step};
    }
    return steps;
  }
  const double usual = plan.level(id.level).border_step_m;
  if (plan.knows_range() && plan.step_of_all(id.level) == usual) return one_step(usual);
  const std::uint32_t columns = tiling::columns(id.level), rows = tiling::rows(id.level);
  double around[3][3] = {};  // [south to north][west to east]
  for (std::uint32_t j = 0; j < 3; ++j)
    for (std::uint32_t i = 0; i < 3; ++i) {
      if (id.y + j < 1 || id.y + j > rows) continue;  // beyond a pole there is no tile
      const TileId tile{id.level, (id.x + columns + i - 1) % columns, id.y + j - 1};
      const auto step = step_alone(*surface.only(), plan, tile, stop);
      if (!step) return std::unexpected(step.error());
      around[j][i] = *step;
    }
  const auto corner = [&](int j, int i) {
    return std::max({around[j][i], around[j][i + 1], around[j + 1][i], around[j + 1][i + 1]});
  };
  const double south_west = corner(0, 0), south_east = corner(0, 1), north_west = corner(1, 0),
               north_east = corner(1, 1);
  HeightSteps steps;
  steps.own = around[1][1];
  const auto set = [&](TileSide side, double beside, double start, double end) {
    steps.sides[std::size_t(side)] = std::max(steps.own, beside);
    steps.ends[std::size_t(side)] = {start, end};
  };
  set(TileSide::west, around[1][0], south_west, north_west);
  set(TileSide::south, around[0][1], south_west, south_east);
  set(TileSide::east, around[1][2], south_east, north_east);
  set(TileSide::north, around[2][1], north_west, north_east);
  return steps;
}

std::optional<double> StepMemo::find(TileId id) const {
  const std::scoped_lock lock(mutex_);
  const auto found = steps_.find(id);
  return found == steps_.end() ? std::nullopt : std::optional(found->second);
}

void StepMemo::keep(TileId id, double step) {
  const std::scoped_lock lock(mutex_);
  if (steps_.size() >= kMost) steps_.clear();
  steps_[id] = step;
}

}  // namespace tind
