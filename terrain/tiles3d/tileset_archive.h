#pragma once
// 3D Tiles as one file: a .3tz (3D Tiles Archive Format 1.3).

#include <cstdint>
#include <string>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/store/tile_set.h"

namespace tind::tiles3d {

struct ArchiveReport {
  std::uint64_t files = 0, bytes = 0;  // in it without its index; of the archive
};

/// Of a folder that write_tileset() has finished of these tiles: tileset.json, then their contents
/// and subtrees by name, deflated where that saves a tenth, and the index. What else lies there is
/// left out; what should and does not is an error. The same bytes of the same files, for any number
/// of threads. It is renamed into place when it is whole and on the disk; who looks before sees
/// what was there, and a run that was killed leaves FILE.part. Takes a few megabytes and the
/// directory: about 120 bytes a file. invalid_argument: not a finished tileset; out_of_range: a
/// file or the index of 4 GiB, which the format has no room for; busy where a build is at the
/// folder; cancelled.
Result<ArchiveReport> write_archive(const TileSet&, const std::string& folder,
                                    const std::string& file, int threads = 0, const Progress& = {});

}  // namespace tind::tiles3d
