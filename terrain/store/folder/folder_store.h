#pragma once
// A directory as a store that is read.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/store/tile_store.h"

namespace tind {

/// The tiles of DIR, also given as DIR/layer.json, made by `tind build` or anyone: layer.json and
/// z/x/y.terrain, plain or gzipped. An update of `tind build` counts from the moment that it is
/// whole, while its files still move.
std::unique_ptr<TileStore> folder_store(const std::string& directory);

/// What KeptBlocks::encode() gave for the build of this record, whose tiles lie there. not_found,
/// io.
Result<std::string> kept_blocks(const std::string& directory, const BuildRecord&);

/// A file that a store may hold. not_found, or io.
Result<std::vector<std::uint8_t>> read_stored_file(const std::string& path);

}  // namespace tind
