#pragma once
// What a directory of tiles remembers of how they were made, so that a build that was killed goes
// on, and one whose source changed makes again what changed, and nothing else.

#include <string>
#include <vector>

#include "terrain/pyramid/build.h"
#include "terrain/pyramid/source_blocks.h"
#include "terrain/pyramid/tile_order.h"

namespace tind {

/// Makes the directory ours for these options and this content of the source: afterwards every tile
/// in it is one that this build would make. What is there already:
/// - nothing, or tiles of the same: they stay
/// - tiles of the same grid and options but of other heights: those that depend on heights that
///   changed are removed (layer.json first), the others stay
/// - anything else is refused, or with `force` removed.
/// Killed on the way, it does the same when it is called again.
Result<UpdateReport> claim_directory(const DemSource&, const TilePlan&, const TileOrder& ids,
                                     const SourceBlocks&, const BuildOptions&);

/// Aside, then renamed: whoever looks sees the whole file or none.
Result<void> write_whole(const std::string& path, std::string_view bytes);

}  // namespace tind
