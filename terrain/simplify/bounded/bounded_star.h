#pragma once
// The interval test of `bounded`: which heights of a star's apex keep all samples within the band.
//
// A star is an apex w and the edges (a, b) opposite to it, one for each triangle (w, a, b). At a
// sample (p, z) inside such a triangle, the mesh has the height l h + rest(p). Here h is the apex's
// height, l > 0 its barycentric weight, and rest(p) the share of the two ring vertices. So the
// condition |l h + rest(p) - z| <= eps is an interval:
//     (z - rest - eps) / l  <=  h  <=  (z - rest + eps) / l.
// Where the intervals of all samples intersect, the edit is feasible, and no cost function is
// needed. Where they do not, the gap lo - hi says by how much; the directed search tries to close
// it.
//
// Nearly all tests fail, so they should fail early. The samples that ended one test around a vertex
// ("witnesses") are tested first in the next one. A sample between two planes that follow from lo
// and hi costs two comparisons (Samples::scan_outside).

#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/simplify/common/samples.h"

namespace tind {

struct StarOptions {
  double eps = 1;                                // half width of the band, metres
  double height_step = 0;                        // heights are multiples of it (0: free)
  double height_min = -1e30, height_max = 1e30;  // of every vertex
  double place_step = 1;                         // places are multiples of it, mesh units
};

/// What the samples leave for a height, and the samples that set its two ends. Empty when lo > hi.
struct Room {
  static constexpr Vec3 kNone = {0, 0, std::numeric_limits<double>::quiet_NaN()};
  double lo = -std::numeric_limits<double>::infinity();
  double hi = std::numeric_limits<double>::infinity();
  Vec3 at_lo = kNone, at_hi = kNone;
  double gap() const { return lo - hi; }
};

template <class Samples>
class Star {
 public:
  using Index = HalfedgeMesh::Index;

  /// A triangle of the star by its edge of the ring, seen counter-clockwise from the apex. It has
  /// its own copy of the places: each try around a vertex goes over all of them.
  struct RingEdge {
    Index from, to;
    Vec3 a, b;
    double ax, ay, bx, by, area;  // relative to the apex, and twice the triangle's area: aim()
  };

  /// `samples` is not owned.
  Star(const Samples& samples, const StarOptions& options) : samples_(samples), options_(options) {}

  const std::vector<RingEdge>& ring() const { return ring_; }
  void clear() { ring_.clear(); }
  void add(std::span<const RingEdge> edges) {
    ring_.insert(ring_.end(), edges.begin(), edges.end());
  }
  /// Adds the far edges of v's triangles; add_kept: of those that the collapse of edge h, of which
  /// v is an end, keeps.
  void add(const HalfedgeMesh& mesh, Index v);
  void add_kept(const HalfedgeMesh& mesh, Index v, Index h);

  /// Puts the apex at a place (of which only x and y count); false when a triangle is not
  /// counter-clockwise for certain then. Whatever asks for room does this before.
  bool aim(const Vec3& apex);

  /// What all samples leave. Ends early, with a gap that is too large rather than right, once the
  /// gap exceeds `give_up`.
  Room room(const Vec3& apex, double give_up);
  /// The two parts of room(): narrows `room` to what the witnesses leave, and to what all samples
  /// of the triangles from `first` on do.
  void ask_witnesses(const Vec3& apex, Room& room, double give_up) const;
  void narrow(const Vec3& apex, Room& room, double give_up, std::size_t first = 0);
  void forget_witnesses() { witnesses_ = 0; }
  /// Makes a sample a witness; those without a height are none.
  void remember(const Vec3& p) {
    if (!std::isnan(p.z)) witness_[witnesses_++ % witness_.size()] = p;
  }
  void remember(const Room& r) { remember(r.at_lo), remember(r.at_hi); }

  /// The centre of the room, on the height step if there is one; false when nothing fits. Samples
  /// that carry little of the apex's weight would let it fly far off between them: it stays within
  /// the band around what its star's samples span. Where there are none, in a void, it stays as
  /// near to `before` as the heights around it allow.
  bool choose_height(const Vec3& apex, Room room, double before, double& height) const;

  /// Moves the apex to where one Gauss-Newton step would make the sum of the squared errors of the
  /// star's samples least (star_fit.h). False when the step leads nowhere
  /// or out of the star.
  bool least_squares_step(Vec3& apex);

 private:
  const Samples& samples_;
  StarOptions options_;
  std::vector<RingEdge> ring_;
  std::array<Vec3, 8> witness_;
  std::size_t witnesses_ = 0;

  void add_far_edge(const HalfedgeMesh& mesh, Index spoke);
  bool narrow_by(const RingEdge& e, const Vec3& apex, Room& room, double give_up);
  void keep_near_samples(const Vec3& apex, Room& room) const;
};

}  // namespace tind
