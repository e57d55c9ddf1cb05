#pragma once
// How processes that decode are begun: with three descriptors and little else of ours.

#include <sys/types.h>

#include <array>
#include <span>
#include <string>

#include "terrain/base/descriptor.h"
#include "terrain/base/result.h"
#include "terrain/raster/sandbox/wire.h"

namespace tind::sandbox {

/// To where no descriptor of the process's own will be. False, and errno, where there is no room.
bool move_up(Descriptor&);

/// Ours that are to be a process's kSocket, kShared and kBrief; -1: it has none. REQUIRES: moved
/// up.
using Descriptors = std::array<int, 3>;

/// Begins a program with its arguments, with those descriptors alone, and those variables of our
/// environment that its libraries look for their files by. Fails (io) saying why.
Result<pid_t> spawn(std::span<const std::string> command, const Descriptors&);

}  // namespace tind::sandbox
