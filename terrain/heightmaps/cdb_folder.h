#pragma once
// The elevations of a CDB data store, as files.

#include <cstdint>
#include <optional>
#include <string>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/heightmaps/cdb_tile.h"
#include "terrain/surface/surface.h"

namespace tind::cdb {

struct FolderOptions {
  std::string output;               // the data store's root, made if need be
  std::optional<int> deepest = {};  // level; none: the first that is as fine as the surface
  /// None: all of the surface. Across the antimeridian east is beyond 180.
  std::optional<GeoRect> area = {};
  int threads = 0;
};

struct FolderReport {
  int deepest = 0;
  std::uint64_t tiles = 0, kept = 0, bytes = 0;  // kept: of an earlier run; bytes: of all
  std::uint64_t posts = 0, without_height = 0;   // of those that were made now
  double max_deviation_m = 0;
};

/// Primary terrain elevation of every geocell that the surface touches: all levels from -10 to the
/// deepest, as the standard wants; of level 1 and finer those tiles where the surface lies. 32 bits
/// floating point, LZW, metres. A tile may not have holes: voids are filled as in tiles of meshes,
/// and 0, the standard's default, is what lies beyond. Tiles are renamed into place; run again, it
/// goes on, and makes again what was cut off. A folder that holds other things, or tiles of another
/// source, is refused (invalid_argument). Errc::busy where another run is at it. bad_data, and no
/// tiles, where no post of any has a height. REQUIRES: heights above the ellipsoid, or the caller
/// said that they are not.
Result<FolderReport> write_folder(const Surface&, const FolderOptions&, const Progress& = {});

/// What a file holds. REQUIRES: as many heights as the tile has posts.
Result<std::string> encode_tile(const Tile&, const VerticalDatum&, std::vector<float> heights);

}  // namespace tind::cdb
