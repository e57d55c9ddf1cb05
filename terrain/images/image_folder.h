#pragma once
// Tiles of web maps as files, for any static server: the same bytes as on demand.

#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/images/image_source.h"

namespace tind {

struct ImageFolderOptions {
  std::string output;  // directory, made if need be
  int first_level = 0;
  int last_level = -1;  // -1: the deepest that there is
  int threads = 0;      // 0: one per core
  bool force = false;   // replace tiles of another source or content
};

struct ImageFolderReport {
  std::uint64_t tiles = 0, built = 0, reused = 0, bytes = 0;  // bytes: of all tiles
};

/// The tiles that there are of these levels, parents before their children.
std::vector<web_mercator::Tile> image_tiles(const ImageSource&, int first_level, int last_level);

/// Writes z/x/y.png (or .webp) and tiles.json, whose address of tiles is relative to itself.
/// tiles.json comes last, when all tiles stay also if the power is cut. Killed and run again, it
/// goes on: a tile that is there counts if every checksum in it is right. Tiles of another source
/// or content are refused (invalid_argument), or with `force` removed: those whose level, place and
/// format the folder's record says were made. What lies in the place of an image that is to be made
/// and was not is replaced; all else that others put there stays. A folder that begins with files
/// of others is refused, and so, with nothing changed, is a link or another thing in the place of
/// an image or of a folder of them. Errc::busy where another build runs in it; cancelled on a stop.
Result<ImageFolderReport> write_images(const ImageSource&, const std::string& name,
                                       const ImageFolderOptions&, const Progress& = {});

}  // namespace tind
