#pragma once
// An MBTiles database as a store that is read.

#include <memory>
#include <string>

#include "terrain/store/tile_store.h"

namespace tind {

/// Quantized-mesh tiles in the file of this name, with their layer.json in the metadata, as
/// mbtiles_writer.h leaves them. One that tind wrote is refused (bad_data) when its length or what
/// its metadata say is not as it was written; of tiles that are not, no bytes are given.
std::unique_ptr<TileStore> mbtiles_store(const std::string& file);

}  // namespace tind
