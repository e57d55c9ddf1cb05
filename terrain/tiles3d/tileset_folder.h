#pragma once
// 3D Tiles as files, for any static server: the same bytes as on demand.

#include <cstdint>
#include <string>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/store/tile_set.h"

namespace tind::tiles3d {

struct FolderReport {
  std::uint64_t contents = 0, subtrees = 0, bytes = 0;  // written
  bool there = false;                                   // of these tiles already: nothing was done
};

/// Writes tileset.json, {west,east}/z/x/y.subtree and .glb. tileset.json comes last, when all the
/// others stay also if the power is cut; who looks before sees none. Files of other tiles that were
/// written here are replaced, or removed. A folder that holds anything else is refused. Fails as
/// has_roots() does. On a stop: Errc::cancelled; the next run starts again, which takes little
/// beside making the tiles.
Result<FolderReport> write_tileset(const TileSet&, const std::string& folder, int threads = 0,
                                   const Progress& = {});

}  // namespace tind::tiles3d
