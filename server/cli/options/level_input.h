#pragma once
// --tiles and --level: a question is asked of what clients of a level of tiles see, in place of the
// DEM; its answer then says what the tiles' error means for it.

#include <memory>
#include <string>

#include "server/cli/options/dem_input.h"
#include "terrain/analysis/level_dem.h"
#include "terrain/base/result.h"

namespace tind::cli {

struct LevelInput {
  std::string tiles;
  int level = -1;
  std::string index_dir = {};                                // empty: the default one
  std::shared_ptr<const Environment> environment = nullptr;  // the program's
};

/// --tiles and --level.
void add_level_options(Command, LevelInput&);

/// What a question is asked of.
struct AskedDem {
  std::shared_ptr<const DemSource> dem;
  std::shared_ptr<const TileSet> tiles;   // null: the DEM itself
  std::shared_ptr<const LevelDem> level;  // the same as dem
  bool tin = false;                       // dem is a TIN's posts
  double tin_error_m = 0;                 // as OpenedDem has it

  /// Heights that are asked may be so far off: by the tiles that were read, or from the TIN. 0: the
  /// DEM's own.
  double error_m() const { return level ? level->max_error_m() : tin_error_m; }
};

/// The tiles alone; fails (invalid_argument) without a level.
Result<std::shared_ptr<const TileSet>> open_level_tiles(const LevelInput&);
VerticalDatum datum_of(const TileSet&);

/// The DEM or TIN, or the tiles over a DEM's grid.
Result<AskedDem> open_asked(const DemInput&, const LevelInput&);

}  // namespace tind::cli
