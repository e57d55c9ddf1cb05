#pragma once
// What lies in a folder. A range-for over the standard's iterators throws where the disk fails on
// the way, and their increment(error) ends like at the end: whoever forgets to ask takes a part for
// all.

#include <filesystem>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind {

/// In no order. Fails with "cannot look into PATH: reason": not_found where there is no such
/// folder, else io.
Result<std::vector<std::filesystem::directory_entry>> entries_of(const std::string& folder);
/// And in all folders below, which links to folders are not; a folder before what is in it.
Result<std::vector<std::filesystem::directory_entry>> entries_below(const std::string& folder);

}  // namespace tind
