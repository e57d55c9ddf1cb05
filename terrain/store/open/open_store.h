#pragma once
// From the text that names a store to the store: the one place that knows which kinds there are.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/store/archive_writer.h"
#include "terrain/store/tile_store.h"
#include "terrain/store/tile_writer.h"

namespace tind {

/// Does the text name a tile set, rather than a DEM or a mesh?
bool names_store(const std::string& location);
/// Why it does not, and what does. not_found where nothing is there, else invalid_argument.
Error no_store(const std::string& location);
/// One in a file: X.pmtiles (also at s3:// or http(s)://) or X.mbtiles, there or not.
bool names_archive(const std::string& location);

/// DIR, DIR/layer.json, X.pmtiles, X.mbtiles, http(s)://.../NAME or .../NAME/layer.json,
/// s3://BUCKET/PREFIX, s3://BUCKET/X.pmtiles, http(s)://.../X.pmtiles.
std::unique_ptr<TileStore> open_store(const std::string& location);

/// The store at `location`, made if need be, and locked for a build. Errc::busy where another build
/// has it. Of a directory, which lies in that of no tile set, or of s3://BUCKET/PREFIX; archives
/// are written as a whole.
Result<std::unique_ptr<LockedStore>> lock_store(const std::string& location);

/// An archive that is written as a whole, under a name of one (else invalid_argument). busy where
/// another program writes it.
Result<std::unique_ptr<ArchiveWriter>> write_archive_store(const std::string& file, ArchiveHead);

/// What KeptBlocks::encode() gave for the build of this record, whose tiles lie there. not_found,
/// io.
Result<std::string> read_kept_blocks(const std::string& location, const BuildRecord&);

/// One tile by its own path or URL, as it is stored. not_found, or io.
Result<std::vector<std::uint8_t>> read_one_tile(const std::string& location);

}  // namespace tind
