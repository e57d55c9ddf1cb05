#pragma once
// Who wants the collapses of a method themselves: what progressive meshes are made of.

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "terrain/geo/coordinates.h"

namespace tind {

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

/// One collapse of half-edge `edge`, enough to undo it: `kept` moves from before to after,
/// `removed` goes; `left` and `right` are the apexes of the two triangles that go (right: none on
/// the border). Vertices and half-edges are those of the HalfedgeMesh.
struct Collapse {
  std::uint32_t edge, removed, kept, left, right;
  Vec3 removed_position, kept_before, kept_after;
};

/// The collapse of edge h that leaves its dest at `at`, told before it is made.
Collapse collapse_of(const HalfedgeMesh&, std::uint32_t h, const Vec3& at);

/// THE protocol between methods that collapse and whoever records. A method first runs to its stop,
/// then calls fine(), goes on to `triangles`, or as far as it can, calls collapse() before each
/// collapse of this second part, and base() at the end. All vertices stay on the lattice. For
/// methods with kTellsCollapses; the others do not look at it.
class CollapseRecorder {
 public:
  /// REQUIRES: triangles >= 1.
  CollapseRecorder(const Lattice& on, std::size_t down_to) : lattice(on), triangles(down_to) {}
  virtual ~CollapseRecorder() = default;

  const Lattice lattice;
  const std::size_t triangles;

  /// The mesh before the first collapse. It stays where it is until base().
  virtual void fine(const HalfedgeMesh&) = 0;
  virtual void collapse(const Collapse&) = 0;
  virtual void base(const HalfedgeMesh&) = 0;
};

}  // namespace tind
