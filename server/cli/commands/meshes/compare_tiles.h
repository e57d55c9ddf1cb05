#pragma once
// tind compare --tiles: the pyramid of one DEM by several methods, and one table.

#include <string>
#include <utility>
#include <vector>

#include "server/cli/options/dem_input.h"
#include "terrain/pyramid/plan/tile_set_options.h"

namespace tind::cli {

struct CompareTiles {
  DemInput input;
  /// As they were typed, and what each makes of the options: all make the same tiles otherwise.
  std::vector<std::pair<std::string, TileSetOptions>> methods;
  int threads = 1;
  bool json = false;
  std::string progress = "auto";
};

/// Makes every tile by every method, keeps none, prints, and returns the exit code.
int compare_tiles(const CompareTiles&);

}  // namespace tind::cli
