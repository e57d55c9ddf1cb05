#pragma once
// Stored tiles as a tile set.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "terrain/base/result.h"
#include "terrain/store/tile_set.h"

namespace tind {

/// The tiles of a directory made by `tind build` (or anyone), or of a server: open_store().
Result<std::unique_ptr<TileSet>> open_stored_tiles(const std::string& location);

/// Stands for the build whose tiles open_stored_tiles() would serve now: another number, other
/// tiles. An update counts from the moment that it is whole, while its files still move. Nothing
/// where no sound ledger says so.
std::optional<std::uint64_t> stored_generation(const std::string& location);

}  // namespace tind
