#pragma once
// Where a source is lowest and highest.

#include <stop_token>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/surface/surface.h"

namespace tind {

/// The posts of a source that are lowest and highest; of several, any.
struct HeightExtremes {
  struct Place {
    Geographic where;
    double height_m = 0;  // above the source's datum, as read() gives it
  };
  Place lowest, highest;
};

/// The posts that hold the range of the plan's heights. Where the plan's own pass over the source
/// has met them nothing is read; else (a plan that rests on an index, which knows the range of each
/// tile) the posts of two tiles are. REQUIRES: a plan of this source, of valid posts.
Result<HeightExtremes> find_extremes(const Surface&, const TilePlan&, std::stop_token = {});

}  // namespace tind
