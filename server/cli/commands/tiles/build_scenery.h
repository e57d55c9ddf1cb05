#pragma once
// tind build --format flightgear: FlightGear's scenery in place of tiles.

#include <functional>
#include <memory>
#include <string>

#include "server/cli/program/progress_bar.h"
#include "terrain/base/progress.h"
#include "terrain/flightgear/bucket_plan.h"
#include "terrain/geo/environment.h"
#include "terrain/raster/land_cover.h"
#include "terrain/surface/surface.h"

namespace tind::cli {

struct SceneryArguments {
  flightgear::BucketOptions options;
  std::shared_ptr<const LandCover> cover = {};  // null: none
  std::string output, progress;                 // folder; style of the bar
  int threads = 0;
  bool json = false, force = false;
  /// Of a bar, with a stop by signals.
  std::function<Progress(ProgressBar&)> stoppable;
};

/// Writes it and prints what became of it; the exit code.
int build_scenery(const Surface&, const Environment&, const SceneryArguments&);

}  // namespace tind::cli
