#pragma once
// Collapses rated by the samples themselves: by the sum of their squared errors in the star that a
// collapse leaves, its apex where one Gauss-Newton step puts it (star_fit.h).
//
// The first scan of an edge, at its midpoint, says what the step would bring: that estimate is the
// edge's place in the queue, and the step itself is only taken when its turn comes.
//
// The sums say nothing of the largest error. That is what the cap is for: a star with a worse
// sample is refused. While nothing around a refused edge changes, it is not looked at again until
// the cap is above the sample that was in its way: raising the cap step by step costs little more
// than one run.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "terrain/mesh/triangle_plane.h"
#include "terrain/simplify/collapse/collapse_engine.h"
#include "terrain/simplify/common/star_fit.h"
#include "terrain/simplify/common/terrain_mesh.h"

namespace tind {

/// The engine's Cost and Filter, and the fitting afterwards: all keep `sum_` and the cap.
template <class Samples>
class SquaredError {
  using Index = HalfedgeMesh::Index;
  static constexpr Index kNone = HalfedgeMesh::kNone;
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

 public:
  /// Costs may fall too, but an edge whose cost fell is noticed when its turn comes.
  static constexpr bool kOnlyGrows = true;

  /// Keeps references. With `hold_fixed`, vertices of VertexKind::fixed keep their heights.
  SquaredError(TerrainMesh& terrain, const Samples& samples, double cap, bool hold_fixed = false)
      : terrain_(terrain),
        mesh_(terrain.mesh),
        samples_(samples),
        cap_(cap),
        hold_fixed_(hold_fixed),
        sum_(mesh_.triangle_slots()),
        refused_(mesh_.halfedge_slots()),
        changed_(mesh_.vertex_slots(), 0) {
    for (Index t = 0; t < sum_.size(); ++t)
      if (mesh_.alive_triangle(t))
        sum_[t] = sum_of(corner(3 * t), corner(3 * t + 1), corner(3 * t + 2));
  }

  /// No sample is farther than this from a triangle that is new. What was made before stays.
  void raise_cap(double cap) { cap_ = cap; }
  double cap() const { return cap_; }

  // --- for the engine ----------------------------------------------------------------------------

  float estimate(const HalfedgeMesh& mesh, Index h) {
    if (refused(h)) return kNever;
    if (merge_rule(terrain_, h) != Merge::free) return propose(mesh, h).cost;
    const double before = take_edge(h);
    start_from_middle(h);
    return best_ < kInfinity ? growth(fit_.sum_after_step(), before) : kNever;
  }

  Proposal propose(const HalfedgeMesh&, Index h) {
    const Merge rule = merge_rule(terrain_, h);
    if (rule == Merge::never || refused(h)) return {};
    const double before = take_edge(h);
    best_ = kInfinity;
    if (rule == Merge::free) {
      start_from_middle(h);
      improve();
    } else {
      if (rule != Merge::at_dest) try_end(mesh_.origin(h));
      if (rule != Merge::at_origin) try_end(mesh_.dest(h));
    }
    if (!(best_ < kInfinity)) return {};
    return {growth(best_, before), at_};
  }

  bool allows(const HalfedgeMesh&, Index h, const Vec3& at) {
    take_edge(h);
    if (!ring_ccw(at)) return false;
    if (within_cap(at)) return true;
    refused_[edge(h)] = {float(beyond_), merges_};
    return false;
  }

  /// The engine asks `allows` just before.
  void merge(const HalfedgeMesh&, Index h, const Vec3&) {
    std::size_t i = 0;
    mesh_.for_each_kept(h, [&](Index e) { sum_[HalfedgeMesh::triangle(e)] = ring_sum_[i++]; });
    merge_vertices(terrain_, mesh_.origin(h), mesh_.dest(h));
    ++merges_;
    changed_[mesh_.dest(h)] = merges_;
    mesh_.for_each_kept(
        h, [&](Index e) { changed_[mesh_.dest(e)] = changed_[mesh_.apex(e)] = merges_; });
  }

  // --- when the count is reached -----------------------------------------------------------------

  void fit_vertices() {
    for (Index v = 0; v < mesh_.vertex_slots(); ++v)
      if (mesh_.alive_vertex(v)) fit_vertex(v);
  }

  void flip_edges() {
    for (Index h = 0; h < mesh_.halfedge_slots(); ++h)
      if (mesh_.alive_triangle(h / 3) && mesh_.twin(h) != kNone && mesh_.twin(h) > h) flip(h);
  }

 private:
  using Edge = std::array<Vec3, 2>;             // of a ring, seen counter-clockwise from the apex
  static constexpr double kWorthIt = 1 - 1e-4;  // of the sum, for moving a vertex or an edge

  /// z = height + gx x + gy y through three corners: two multiplications a sample.
  struct Plane {
    double gx, gy, height;
    Plane(const Vec3& a, const Vec3& b, const Vec3& c) {
      const double per_area = 1 / orient2d(a, b, c);
      const Vec2 slope = slope_times_area(a, b, c);
      gx = slope.x * per_area, gy = slope.y * per_area;
      height = a.z - gx * a.x - gy * a.y;
    }
    double at(double x, double y) const { return height + gx * x + gy * y; }
  };
  /// A sample was this far off when the edge's turn came, after so many merges.
  struct Refusal {
    float beyond = 0;
    std::uint32_t after = 0;
  };

  TerrainMesh& terrain_;
  HalfedgeMesh& mesh_;
  const Samples& samples_;
  double cap_;
  bool hold_fixed_;
  std::vector<double> sum_;             // by triangle: of squared errors
  std::vector<Refusal> refused_;        // by edge: its lower half-edge
  std::vector<std::uint32_t> changed_;  // by vertex: the last merge that changed its star
  std::uint32_t merges_ = 0;
  double beyond_ = 0;       // how far the sample was off that ended the last sum_of early
  std::vector<Edge> ring_;  // of the star at hand
  std::vector<double> ring_sum_;
  double best_ = kInfinity;  // the least sum found for it,
  Vec3 at_;                  // where its apex is then,
  StarFit fit_;              // and what the samples said there before it rose

  const Vec3& corner(Index h) const { return mesh_.position(mesh_.origin(h)); }

  static float growth(double after, double before) { return float(std::max(0.0, after - before)); }

  Index edge(Index h) const {
    const Index g = mesh_.twin(h);
    return g < h ? g : h;
  }
  /// Its place would be the same again, and so would be the sample that was too far off.
  bool refused(Index h) const {
    const Refusal& r = refused_[edge(h)];
    return double(r.beyond) > cap_ && r.after >= changed_[mesh_.origin(h)] &&
           r.after >= changed_[mesh_.dest(h)];
  }

  double add_to_ring(Index e) {
    ring_.push_back({mesh_.position(mesh_.dest(e)), mesh_.position(mesh_.apex(e))});
    return sum_[HalfedgeMesh::triangle(e)];
  }

  /// The ring that the collapse of h leaves. Returns the present sum of all triangles concerned.
  double take_edge(Index h) {
    ring_.clear();
    double before = sum_[HalfedgeMesh::triangle(h)];
    if (const Index g = mesh_.twin(h); g != kNone) before += sum_[HalfedgeMesh::triangle(g)];
    mesh_.for_each_kept(h, [&](Index e) { before += add_to_ring(e); });
    return before;
  }

  bool ring_ccw(const Vec3& apex) const {
    for (const Edge& e : ring_)
      if (!Samples::takes(apex, e[0], e[1])) return false;
    return true;
  }

  StarFit measure(const Vec3& w) const {
    StarFit f;
    for (const auto& [a, b] : ring_) f.add(samples_, w, a, b);
    return f;
  }

  /// Takes place p, at its best height, if it beats the best so far.
  bool try_at(const Vec3& p) {
    if (!ring_ccw(p)) return false;
    const StarFit f = measure(p);
    if (!(f.sum_after_rise() < best_)) return false;
    best_ = f.sum_after_rise();
    fit_ = f;
    at_ = {p.x, p.y, p.z + f.rise()};
    return true;
  }

  /// An end that stays where it is, seen from above.
  void try_end(Index v) {
    const Vec3& p = mesh_.position(v);
    if (!hold_fixed_ || terrain_.kind[v] != VertexKind::fixed) {
      try_at(p);
      return;
    }
    if (!ring_ccw(p)) return;
    const StarFit f = measure(p);
    if (!(f.sum < best_)) return;
    best_ = f.sum;
    at_ = p;
  }

  void start_from_middle(Index h) {
    const Vec3 &a = mesh_.position(mesh_.origin(h)), &b = mesh_.position(mesh_.dest(h));
    best_ = kInfinity;
    const Vec3 middle = (a + b) * 0.5;
    if (try_at({snap_to_lattice(middle.x), snap_to_lattice(middle.y), middle.z})) return;
    try_at(a);
    try_at(b);
  }

  /// One Gauss-Newton step, shortened where it would leave the star.
  void improve() {
    if (!(best_ < kInfinity)) return;
    Vec2 s = fit_.step_inside();
    for (int k = 0; k < 2; ++k, s = {s.x / 2, s.y / 2}) {
      const Vec3 p{snap_to_lattice(at_.x + s.x), snap_to_lattice(at_.y + s.y), at_.z};
      if (p.x == at_.x && p.y == at_.y) return;
      if (!ring_ccw(p)) continue;
      try_at(p);
      return;
    }
  }

  /// The sum of squared errors of a triangle; infinite when one exceeds `limit`.
  double sum_of(const Vec3& a, const Vec3& b, const Vec3& c, double limit = kInfinity) {
    const Plane plane(a, b, c);
    double sum = 0;
    const bool whole = samples_.scan(a, b, c, [&](double x, double y, double z, std::size_t) {
      const double r = z - plane.at(x, y);
      sum += r * r;
      beyond_ = std::abs(r);
      return beyond_ <= limit;
    });
    return whole ? sum : kInfinity;
  }

  /// The star with this apex: its sums go to ring_sum_.
  bool within_cap(const Vec3& apex) {
    ring_sum_.clear();
    for (const Edge& e : ring_) {
      ring_sum_.push_back(sum_of(apex, e[0], e[1], cap_));
      if (ring_sum_.back() == kInfinity) return false;
    }
    return true;
  }

  void fit_vertex(Index v) {
    ring_.clear();
    double before = 0;
    mesh_.for_each_out(v, [&](Index e) { before += add_to_ring(e); });
    best_ = kInfinity;
    if (!try_at(mesh_.position(v))) return;
    if (terrain_.kind[v] == VertexKind::interior) improve();
    if (!(best_ < before * kWorthIt) || !within_cap(at_)) return;
    mesh_.position(v) = at_;
    std::size_t i = 0;
    mesh_.for_each_out(v, [&](Index e) { sum_[HalfedgeMesh::triangle(e)] = ring_sum_[i++]; });
  }

  /// Flips the edge when the other diagonal of its two triangles follows the samples better.
  void flip(Index h) {
    const Index g = mesh_.twin(h), t = HalfedgeMesh::triangle(h), u = HalfedgeMesh::triangle(g);
    const Vec3 &a = corner(h), &b = mesh_.position(mesh_.dest(h));
    const Vec3 &c = mesh_.position(mesh_.apex(h)), &d = mesh_.position(mesh_.apex(g));
    if (!Samples::takes(a, d, c) || !Samples::takes(d, b, c)) return;
    const double before = (sum_[t] + sum_[u]) * kWorthIt;
    const double first = sum_of(a, d, c, cap_);
    if (!(first < before)) return;
    const double second = sum_of(d, b, c, cap_);
    if (!(first + second < before)) return;
    mesh_.flip(h);
    sum_[t] = first;  // h now runs from d to c
    sum_[u] = second;
  }
};

}  // namespace tind
