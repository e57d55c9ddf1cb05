#pragma once
// What a simplification is asked for: the options of all methods, when to stop, who listens.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/mesh/side.h"
#include "terrain/mesh/tin.h"
#include "terrain/simplify/common/effort.h"

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
/// All vertices stay on the lattice. For edge-cost, qem, memoryless, attribute-qem and
/// triangle-collapse; the others do not look at it.
struct CollapseRecorder {
  Lattice lattice;
  std::size_t triangles = 1;
  std::function<void(const HalfedgeMesh&)> fine;  // the mesh before the second part; it stays there
  std::function<void(const Collapse&)> collapse;  // before each
  std::function<void(const HalfedgeMesh&)> base;  // the mesh at the end
};

/// The method of who names none: it has the fewest triangles within an error, and the smallest RMS
/// at a count (docs/methods.md); for general meshes, which it does not take, the best that does.
inline constexpr const char* kDefaultMethod = "bounded";
inline constexpr const char* kDefaultMeshMethod = "qem";

/// Options of all methods; each method reads its own and the table says which.
struct SimplifyOptions {
  std::string method = kDefaultMethod;
  StopAt stop;
  double alpha = 0.25, beta = 2;      // edge-cost; NaN-free, dimensionless (edge_cost.h)
  std::string term = "all";           // edge-cost: all | length | height | degree
  Effort effort = Effort::normal;     // bounded
  Side side = Side::both;             // bounded
  bool subset_placement = false;      // qem
  bool border_constraints = false;    // qem
  std::string criterion = "plane";    // vertex-removal: plane | degree | k-degree
  int k = 6;                          // vertex-removal k-degree: neighbours that break a tie
  std::string placement = "quadric";  // triangle-collapse: quadric | centroid
  // attribute-qem:
  std::string attributes = "auto";         // auto | texture | colour | normal | colour+normal
  std::string attribute_metric = "joint";  // joint | separate | ignored
  double attribute_weight = 1;             // against position; 1 is the measured default
  std::shared_ptr<const std::vector<std::array<float, 3>>>
      drape;  // terrain: a colour for each post
  /// Lines that stay edges, level polygons, a boundary. The DEM is then constraints->dem.
  std::shared_ptr<const Constraints> constraints;
  int threads = 1;
  const CollapseRecorder* recorder = nullptr;  // not owned
};

/// Fails (invalid_argument) unless exactly one condition is set and makes sense.
Result<void> check_stop(const StopAt&);

}  // namespace tind
