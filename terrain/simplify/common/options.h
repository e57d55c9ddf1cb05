#pragma once
// What every simplification is asked for: when to stop, around which lines, who listens.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"
#include "terrain/simplify/common/collapse_recorder.h"

namespace tind {

/// When to stop. Exactly one is set; `ratio` is of the full grid's triangle count. A count is never
/// exceeded where the method can go so low; Simplified::note says so where it cannot.
struct StopAt {
  std::optional<std::uint64_t> triangles = {};
  std::optional<double> ratio = {};        // 0 < ratio <= 1
  std::optional<double> max_error_m = {};  // strict: over every valid post, in double precision
};

struct Constraints;  // constraints.h

/// What every method reads; its own options are beside each method.
struct RunOptions {
  StopAt stop;
  /// Lines that stay edges, level polygons, a boundary. The DEM is then constraints->dem.
  std::shared_ptr<const Constraints> constraints;
  int threads = 1;
  CollapseRecorder* recorder = nullptr;  // not owned
};

/// Fails (invalid_argument) unless exactly one condition is set and makes sense.
Result<void> check_stop(const StopAt&);

}  // namespace tind
