#pragma once
// Tiles of a store, without the DEM that they were made of.

#include <string>

#include "terrain/base/result.h"
#include "terrain/dataset/dataset.h"

namespace tind {

/// What open_stored_tiles() opens, and fails where that does. A folder with a sound ledger gives
/// the tiles of that ledger's record and no others; renewed() opens those of another.
Result<Dataset> stored_dataset(const std::string& location);

}  // namespace tind
