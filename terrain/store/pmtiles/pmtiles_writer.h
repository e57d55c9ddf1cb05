#pragma once
// Writes a PMTiles archive: clustered, every directory and tile packed with gzip, each tile by
// itself (no two are the same: they hold where they are). The same tiles and the same head make the
// same bytes.

#include <memory>
#include <string>

#include "terrain/store/archive_writer.h"

namespace tind {

/// Memory: 24 bytes a tile. Disk, on the way: the file twice. Fails as PartFile::begin().
Result<std::unique_ptr<ArchiveWriter>> write_pmtiles(const std::string& file, ArchiveHead);

}  // namespace tind
