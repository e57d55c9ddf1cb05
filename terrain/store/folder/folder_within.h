#pragma once
// Whether what is to be written would come to lie in a level of a tile set.

#include <string>

#include "terrain/base/result.h"

namespace tind::folder {

/// Is a path, which need not be there, that folder, or in it? Links are followed. io where it
/// cannot be told.
Result<bool> lies_within(const std::string& path, const std::string& folder);

/// Fails (invalid_argument) where a folder, which need not be there, is a level's folder of a tile
/// set (which has a ledger), or would lie in one: what is made there is foreign to that tile set,
/// which is then not whole. Beside its levels anything may lie. io where it cannot be told.
Result<void> lies_in_no_level(const std::string& folder);

}  // namespace tind::folder
