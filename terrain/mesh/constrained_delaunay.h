#pragma once
// Lines in the plane, made fit to be edges of a mesh, and triangulations that have them as edges.
// The only user of CGAL (constrained Delaunay triangulation, exact predicates).
//
// Lines of real data cross, overlap, repeat and touch by a hair. repair_lines turns any set of
// segments into a network: segments meet only at their ends, and nothing is closer to a segment
// than kLineTolerance without being on it. Whoever triangulates the network afterwards never meets
// a degenerate case.
//
// All positions are multiples of 1 / kLineLattice of a post. With coordinates below 2^15 posts,
// the points that halve a segment up to twelve times are then exact doubles, and lie on it exactly.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"

namespace tind {

inline constexpr double kLineLattice = 16777216;      // 2^24 places in a post
inline constexpr double kLineTolerance = 1.0 / 1024;  // posts: what is nearer counts as touching

/// A coordinate brought to the lattice of lines. REQUIRES: below 2^27.
inline double snap_to_line_lattice(double v) {
  return std::nearbyint(v * kLineLattice) / kLineLattice;
}

/// From points[a] to points[b]; part of the input segment `source`.
struct LineSegment {
  std::uint32_t a, b, source;
  auto operator<=>(const LineSegment&) const = default;
};

struct LineNetwork {
  std::vector<Vec3> points;  // on the lattice; z: a height, or NaN where the line brings none
  std::vector<LineSegment> segments;
};

struct LineRepairs {
  std::size_t crossings = 0;  // vertices added where segments cross
  std::size_t joined = 0;     // points moved onto another that was within the tolerance
  std::size_t bent = 0;       // segments led through a point within the tolerance
  std::size_t dropped = 0;    // segments that still crossed after many rounds, and were left out
};

/// False when this program was built without CGAL: the two functions below then fail (unsupported).
bool has_constrained_delaunay();

/// Makes `network` a network as above. A segment that is split or bent becomes several, all with
/// its `source`; one that several sources share is there for each, twice for one that runs along it
/// an even number of times (an outline that folds onto itself: no place changes sides there).
/// Points only get more; heights of crossings are linear along the first segment that has heights.
/// REQUIRES: points on the lattice, finite x and y, valid indices. Deterministic; O(n log n)
/// typically.
Result<LineRepairs> repair_lines(LineNetwork& network);

/// The constrained Delaunay triangulation of all points (those not in `edges` too) in the plane:
/// counter-clockwise triangles that cover their convex hull. Equal points share the first one's
/// index. REQUIRES: edges cross no other edge; a point exactly on an edge splits it. (Should edges
/// cross all the same, the crossing is appended to `points`, with height NaN.)
Result<std::vector<Triangle>> triangulate(std::vector<Vec3>& points,
                                          std::span<const std::array<std::uint32_t, 2>> edges);

}  // namespace tind
