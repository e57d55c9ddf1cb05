#pragma once
// Whether a name still means the file that was opened by it: who takes a file for itself has to ask
// once it has it, because whoever had it before may have removed or renamed it.

#include <string>

#include "terrain/base/result.h"

namespace tind {

/// No where there is nothing of that name. Fails (io) where the system does not say: whoever tries
/// again until it is must not try for ever.
Result<bool> is_still_at(int file, const std::string& path);

}  // namespace tind
