#pragma once
// What every simplification is asked for: when to stop, around which lines, who listens.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"

namespace tind {

/// When to stop. Exactly one is set; `ratio` is of the full grid's triangle count. A count is never
/// exceeded where the method can go so low; Simplified::note says so where it cannot.
struct StopAt {
  std::optional<std::uint64_t> triangles = {};
  std::optional<double> ratio = {};        // 0 < ratio <= 1
  std::optional<double> max_error_m = {};  // strict: over every valid post, in double precision
};

struct Constraints;  // constraints.h
struct Collapse;     // collapse_engine.h
class HalfedgeMesh;

/// Positions that cost few bits: x and y are multiples of 1 / per_post, heights of z_step_m.
struct Lattice {
  double per_post = 1024;  // a power of two, at most 1024
  double z_step_m = 0;     // 0: any height

  Vec3 snap(const Vec3& p) const {
    constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52: the sum has no fraction
    return {(p.x * per_post + kRound - kRound) / per_post,
            (p.y * per_post + kRound - kRound) / per_post,
            z_step_m > 0 ? std::nearbyint(p.z / z_step_m) * z_step_m : p.z};
  }
};

/// Who wants the collapses themselves (terrain/progressive). The method first runs to its `stop`,
/// then goes on to `triangles`, or as far as it can, and tells each collapse of this second part.
/// All vertices stay on the lattice. For methods with kTellsCollapses; the others do not look at
/// it.
struct CollapseRecorder {
  Lattice lattice;
  std::size_t triangles = 1;
  std::function<void(const HalfedgeMesh&)> fine;  // the mesh before the second part; it stays there
  std::function<void(const Collapse&)> collapse;  // before each
  std::function<void(const HalfedgeMesh&)> base;  // the mesh at the end
};

/// What every method reads; its own options are beside each method.
struct RunOptions {
  StopAt stop;
  /// Lines that stay edges, level polygons, a boundary. The DEM is then constraints->dem.
  std::shared_ptr<const Constraints> constraints;
  int threads = 1;
  const CollapseRecorder* recorder = nullptr;  // not owned
};

/// Fails (invalid_argument) unless exactly one condition is set and makes sense.
Result<void> check_stop(const StopAt&);

}  // namespace tind
