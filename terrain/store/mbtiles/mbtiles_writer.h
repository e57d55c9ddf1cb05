#pragma once
// Writes an MBTiles database (github.com/mapbox/mbtiles-spec, 1.3): rows from the south, tiles
// packed with gzip, in the order of their places. The same tiles and the same head make the same
// bytes, with the same version of SQLite.

#include <memory>
#include <string>

#include "terrain/store/archive_writer.h"

namespace tind {

/// Fails as PartFile::begin(), and where the database cannot be made.
Result<std::unique_ptr<ArchiveWriter>> write_mbtiles(const std::string& file, ArchiveHead);

}  // namespace tind
