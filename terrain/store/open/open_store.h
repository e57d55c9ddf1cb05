#pragma once
// From the text that names a store to the store: the one place that knows which kinds there are.

#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/store/tile_writer.h"

namespace tind {

/// The store at `location`, made if need be, and locked for a build. Errc::busy where another build
/// has it. Today: a directory.
Result<std::unique_ptr<LockedStore>> lock_store(const std::string& location);

}  // namespace tind
