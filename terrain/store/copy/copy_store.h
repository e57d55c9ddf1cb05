#pragma once
// From one store into another, of whichever kinds: the same tiles, layer.json, record and hashes of
// blocks. The same tiles make the same archive, wherever they come from.

#include <cstdint>
#include <string>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/store/tile_store.h"

namespace tind {

/// Tiles of one set, at most: what is made of more could not be copied, nor joined of shards.
inline constexpr std::uint64_t kMostCopiedTiles = 400'000'000;

struct CopyOptions {
  bool force = false;   // replace tiles that tind made of another source or otherwise
  int threads = 0;      // 0: one per core; eight where tiles come from a server or go to one
  bool packed = false;  // the store's tiles are packed as this program packs them: they stay so
};

struct CopyReport {
  std::uint64_t tiles = 0;
  std::uint64_t kept = 0;       // of them, of an earlier copy into a directory
  std::uint64_t bytes = 0;      // of tiles, as they are stored now
  std::uint64_t unvouched = 0;  // tiles that the store which they come from keeps no hashes of
};

/// All tiles that layer.json calls available, into X.pmtiles, X.mbtiles or a directory, which is
/// made; or into s3://BUCKET/X.pmtiles or s3://BUCKET/PREFIX (object_writer.h). An archive gets its
/// name when it is whole, a directory its layer.json. What lies there:
/// - an earlier copy, or tiles that can become these by an update: replaced; in a directory only
///   what differs
/// - tiles that tind made otherwise: refused (invalid_argument), or with `force` replaced
/// - anything else: refused
/// Fails (io, not_found, bad_data) for a tile that is missing, or is not as it was written.
/// Cancelled: nothing torn.
Result<CopyReport> copy_store(const TileStore& from, const std::string& to, const CopyOptions&,
                              const Progress& = {});

}  // namespace tind
