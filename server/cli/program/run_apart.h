#pragma once
// One run of a method in a process of its own, so that none finds memory warm, or pays for memory,
// that another left: what is measured does not depend on what ran before.

#include <functional>

#include "terrain/base/result.h"
#include "terrain/simplify/common/simplified.h"

namespace tind::cli {

struct MeasuredRun {
  Result<Simplified> made;
  double seconds = 0, cpu_seconds = 0;  // by the clock; of all its threads
  double peak_mb = 0;                   // of memory, the heights included
  std::uint64_t page_faults = 0;        // memory touched for the first time, in pages
};

/// Whatever makes a mesh, with its result. Fails (internal) when the process ended by itself, which
/// mostly means that memory ran out. REQUIRES: no other thread runs.
MeasuredRun run_apart(const std::function<Result<Simplified>()>& make);

}  // namespace tind::cli
