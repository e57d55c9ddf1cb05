#pragma once
// On which steps the heights of a tile's borders stand: so fine as its level's errors ask for, or
// as much coarser as the heights near it need.
//
// A tile's heights are 32767 steps at most. Which step is enough goes by the posts in and around
// the tile, not by all posts of the source: so a tile can be made before those are known, and a
// peak far away rounds nothing here. Two tiles that share a side use the coarser of their steps
// there, four that share a corner the coarsest of theirs: both ask the same posts, so both get the
// same heights.

#include <array>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>

#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/surface/surface.h"

namespace tind {

class TilePlan;
struct LevelPlan;

/// Heights farther from 0 than this, metres, are none of a planet's: steps for them would round
/// those of the tiles beside beyond use.
inline constexpr double kFarthestHeight_m = 500'000;
/// bad_data, with what to do, where one of these is.
Result<void> check_heights(const DemInfo&, double low, double high);

/// So many posts around a tile can say which step its heights need: those that fill voids at its
/// border.
inline constexpr int kStepReach = 68;

/// Powers of two, metres.
struct HeightSteps {
  double own = 1;                                  // of the tile; it divides all others
  std::array<double, 4> sides = {1, 1, 1, 1};      // by TileSide
  std::array<std::array<double, 2>, 4> ends = {};  // of a side: at its start, at its end
};

/// The finest step on which a tile's lowest and highest height are floats, which is what headers of
/// tiles hold: of heights up to 16 km 1/1024. `farthest_m`: of its heights from 0.
double finest_step(double farthest_m);
/// The step that an error asks for, or as much coarser as 32767 of them need to span `relief_m`, or
/// heights so far from 0 need.
double step_for(double error_m, double relief_m, double farthest_m);
/// That of heights between `low` and `high` with the errors of a level around them.
double height_step(const LevelPlan&, double low, double high);

/// Of a tile of the plan. Reads the posts in and around it and its neighbours, unless the plan
/// knows all heights and those need no coarser steps. Fails where a block is unreadable, as
/// check_heights() does, with cancelled on a stop. REQUIRES: a plan that knows all heights for a
/// tile that rests on them (TilePlan::rests_on_all_heights).
Result<HeightSteps> height_steps(const Surface&, const TilePlan&, TileId, std::stop_token = {});

/// Steps that were found: each tile is asked for by nine. Thread-safe.
class StepMemo {
 public:
  std::optional<double> find(TileId) const;
  void keep(TileId, double step);

 private:
  static constexpr std::size_t kMost = 1 << 16;  // then it begins anew
  mutable std::mutex mutex_;
  std::map<TileId, double> steps_;
};

}  // namespace tind
