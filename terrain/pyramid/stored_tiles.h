#pragma once
// Which tiles a folder of a build holds at this moment.

#include <cstdint>
#include <optional>
#include <string>

namespace tind {

/// Stands for the record of the build whose tiles open_stored_tiles() would serve now: another
/// number, other tiles. An update counts from the moment that it is whole, while its files still
/// move. Nothing where no sound ledger says so, or the tiles are not in a directory.
std::optional<std::uint64_t> stored_generation(const std::string& directory);

}  // namespace tind
