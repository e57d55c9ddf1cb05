#pragma once
// An update, or a copy over an earlier one, that takes most of the tiles away: a file that was
// forgotten, or a folder that was not mounted, more often than what somebody wants.

#include <string>
#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/base/result.h"

namespace tind {

using AvailableTiles =
    std::vector<std::vector<proto::TileRange>>;  // as layer.json has them, by level

/// invalid_argument, saying how many, where more than half of the tiles that there are would be no
/// tiles of the new set.
Result<void> most_stay(const std::string& store, const AvailableTiles& there,
                       const AvailableTiles& wanted);

}  // namespace tind
