#pragma once
// What each effort means to the mesher: one table, a row for a mesh and a row for a tile.

#include "terrain/simplify/bounded/bounded_mesher.h"
#include "terrain/simplify/common/effort.h"

namespace tind {

struct SearchEffort {
  double reach;      // MesherOptions::search_reach, and so on
  int rounds;        // with flips from 2 on
  int move_tries;    // between two rounds
  double step_gain;  // 0: every gain is worth a step
};

/// Of one mesh of a whole DEM.
SearchEffort mesh_effort(Effort);

/// Of one tile. There are thousands and somebody waits for each, so `normal` does without rounds.
/// `best` has more of them than a mesh's best: the last ones win little, but the bytes of finished
/// tiles rest on their number (kTileEpoch), and levelling the two would change them for nothing.
SearchEffort tile_effort(Effort);

void set_effort(const SearchEffort&, MesherOptions&);

}  // namespace tind
