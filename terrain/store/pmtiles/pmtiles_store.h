#pragma once
// A PMTiles archive as a store that is read.

#include <memory>
#include <string>

#include "terrain/store/tile_store.h"

namespace tind {

/// Quantized-mesh tiles in the file of this name (or s3://, https://: raster/remote/objects.h),
/// with their layer.json in the metadata, as pmtiles_writer.h leaves them. One that tind wrote is
/// refused (bad_data) when a byte of its header, root directory or metadata is not as it was
/// written, or its length; what is wrong with the rest shows when it is read, and no other bytes of
/// a tile are given. Gives the tiles of the file that it opened, also when another takes its name.
/// Memory: the root, and some leaves.
std::unique_ptr<TileStore> pmtiles_store(const std::string& file);

}  // namespace tind
