#pragma once
// 3D Tiles as files, for any static server: the same bytes as on demand.

#include <cstdint>
#include <string>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/encode/glb_tile.h"
#include "terrain/raster/draped.h"
#include "terrain/store/tile_set.h"

namespace tind::tiles3d {

struct FolderReport {
  std::uint64_t contents = 0, subtrees = 0, bytes = 0;  // written by this run
  std::uint64_t kept_subtrees = 0;                      // of an earlier run, with all its contents
  bool there = false;                                   // of these tiles already: nothing was done
};

struct FolderOptions {
  GlbCompression compression = GlbCompression::none;
  int threads = 0;
  Draped draped = {};  // as Source has it
  /// After so many subtrees, those that are done are put beyond power cuts, and named as done.
  std::size_t batch = 64;
};

/// Writes tileset.json, {west,east}/z/x/y.subtree and .glb. tileset.json comes last, when all the
/// others stay also if the power is cut; who looks before sees none. A run that was stopped, killed
/// or cut off goes on when it is run again, and one that has ended makes again what is gone or
/// shorter than its header says: a look at the first bytes of each file. Files of other tiles that
/// were written here are replaced, or removed; nothing else in the folder is touched. A folder that
/// holds other files, or tiles of another compression, is refused. With something else draped they
/// are other tiles. Errc::busy where another run is at it; fails as has_roots() does. On a stop:
/// Errc::cancelled.
Result<FolderReport> write_tileset(const TileSet&, const std::string& folder,
                                   const FolderOptions& = {}, const Progress& = {});

}  // namespace tind::tiles3d
