// The cost is a handful of arithmetic on the four corners of an edge's two triangles. Squares are
// compared instead of radii, so an edge takes one division and one square root: with lengths a, b,
// c and n the cross product of two sides, R^2 = a^2 b^2 c^2 / (4 |n|^2).

#include "terrain/simplify/collapse/edge_cost.h"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/simplify/common/samples.h"
#include "terrain/simplify/common/star_fit.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;

struct Weights {
  double length = 1, height = 0, degree = 0;  // of L, h, d; already scaled
};

class EdgeCost {
 public:
  /// A collapse makes the edges around it longer, so their costs hardly ever fall; one that does is
  /// noticed when its turn comes. (Evaluating all edges around each collapse instead takes twice
  /// the time and changes the RMS error by 2 % at most, either way.)
  static constexpr bool kOnlyGrows = true;

  /// `fit`: of the samples that the merged vertex is to be fitted to; empty: the midpoint.
  EdgeCost(TerrainMesh& terrain, FitSamples fit)
      : terrain_(terrain), fit_(std::move(fit)), degree_(terrain.mesh.vertex_slots(), 0) {
    const HalfedgeMesh& m = terrain.mesh;
    for (Index h = 0; h < m.halfedge_slots(); ++h) {
      ++degree_[m.origin(h)];
      if (m.twin(h) == kNone) ++degree_[m.dest(h)];
    }
  }

  float estimate(const HalfedgeMesh& m, Index h) const {
    if (m.twin(h) == kNone) return kNever;
    switch (merge_rule(terrain_, h)) {
      case Merge::free:
      case Merge::at_dest:
      case Merge::either:
      case Merge::at_origin:
        return float(cost(m, h));
      default:
        return kNever;
    }
  }

  Proposal propose(const HalfedgeMesh& m, Index h) {
    Vec3 at;
    switch (merge_rule(terrain_, h)) {
      case Merge::free:
        at = midpoint(m.position(m.origin(h)), m.position(m.dest(h)));
        if (fit_) at = fitted(m, h, at);
        break;
      case Merge::at_dest:
      case Merge::either:
        at = m.position(m.dest(h));
        break;
      case Merge::at_origin:
        at = m.position(m.origin(h));
        break;
      default:
        return {};
    }
    if (m.twin(h) == kNone) return {};
    return {float(cost(m, h)), at};
  }

  void merge(const HalfedgeMesh& m, Index h, const Vec3&) {
    const Index a = m.origin(h), b = m.dest(h);
    merge_vertices(terrain_, a, b);
    degree_[b] += degree_[a] - 4;
    --degree_[m.apex(h)];
    --degree_[m.apex(m.twin(h))];
  }

  /// The three terms of an inner edge.
  double length_term(const HalfedgeMesh& m, Index h) const {
    const Vec3 a = terrain_.metric(m.position(m.origin(h)));
    const Vec3 ab = terrain_.metric(m.position(m.dest(h))) - a;
    const Vec3 ac = terrain_.metric(m.position(m.apex(h))) - a;
    const Vec3 ad = terrain_.metric(m.position(m.apex(m.twin(h)))) - a;
    const double l2 = dot(ab, ab);
    // Twice the edge's length times a circumradius, squared, is l2 * (rest / |n|^2).
    const Vec3 nc = cross(ab, ac), nd = cross(ad, ab), bc = ac - ab, bd = ad - ab;
    const double c_rest = dot(ac, ac) * dot(bc, bc), c_n = dot(nc, nc);
    const double d_rest = dot(ad, ad) * dot(bd, bd), d_n = dot(nd, nd);
    const bool c_smaller = c_rest * d_n < d_rest * c_n;
    return 0.5 * l2 * std::sqrt(c_smaller ? c_rest / c_n : d_rest / d_n);
  }
  static double height_term(const HalfedgeMesh& m, Index h) {
    return std::fabs(m.position(m.origin(h)).z - m.position(m.dest(h)).z);
  }
  double degree_term(const HalfedgeMesh& m, Index h) const {
    return double(degree_[m.origin(h)] + degree_[m.dest(h)] - 4);
  }

  void set(const Weights& weights) { weights_ = weights; }

 private:
  TerrainMesh& terrain_;
  FitSamples fit_;
  Weights weights_;
  std::vector<std::uint32_t> degree_;      // edges per vertex
  std::vector<std::array<Vec3, 2>> ring_;  // of the star at hand, seen from its apex

  static Vec3 midpoint(const Vec3& a, const Vec3& b) {
    return {snap_to_lattice((a.x + b.x) / 2), snap_to_lattice((a.y + b.y) / 2), (a.z + b.z) / 2};
  }

  bool ring_ccw(const Vec3& apex) const {
    for (const auto& [a, b] : ring_)
      if (!surely_ccw(apex, a, b)) return false;
    return true;
  }

  /// What the samples of the ring say of an apex there.
  StarFit measure(const Vec3& apex) const {
    StarFit f;
    for (const auto& [a, b] : ring_) fit_(f, apex, a, b);
    return f;
  }

  /// The header's `fit`, from the midpoint.
  Vec3 fitted(const HalfedgeMesh& m, Index h, const Vec3& middle) {
    ring_.clear();
    m.for_each_kept(h, [&](Index e) {
      ring_.push_back({m.position(m.dest(e)), m.position(m.apex(e))});
    });
    if (!ring_ccw(middle)) return middle;  // where no collapse is allowed
    const StarFit here = measure(middle);
    const Vec3 raised = {middle.x, middle.y, middle.z + here.rise()};
    Vec2 step = here.step_inside();
    for (int k = 0; k < 2; ++k, step = {step.x / 2, step.y / 2}) {
      const Vec3 p{snap_to_lattice(raised.x + step.x), snap_to_lattice(raised.y + step.y),
                   raised.z};
      if (p.x == middle.x && p.y == middle.y) break;
      if (!ring_ccw(p)) continue;
      const StarFit there = measure(p);
      if (there.sum_after_rise() < here.sum_after_rise()) return {p.x, p.y, p.z + there.rise()};
      break;
    }
    return raised;
  }

  double cost(const HalfedgeMesh& m, Index h) const {
    double c = 0;
    if (weights_.length != 0) c += weights_.length * length_term(m, h);
    if (weights_.height != 0) c += weights_.height * height_term(m, h);
    if (weights_.degree != 0) c += weights_.degree * degree_term(m, h);
    return c;
  }
};

/// Mean L over mean h and over mean d, over the inner edges of the input mesh.
struct Scales {
  double alpha = 0, beta = 0;
};

Scales scales_of(const HalfedgeMesh& m, const EdgeCost& cost) {
  double length = 0, height = 0, degree = 0;
  for (Index h = 0; h < m.halfedge_slots(); ++h) {
    if (m.twin(h) == kNone || m.twin(h) < h) continue;
    length += cost.length_term(m, h);
    height += EdgeCost::height_term(m, h);
    degree += cost.degree_term(m, h);
  }
  return {height > 0 ? length / height : 0, degree > 0 ? length / degree : 0};
}

Weights weights_of(const EdgeCostOptions& options, const Scales& scales) {
  switch (options.term) {
    case Term::length:
      return {1, 0, 0};
    case Term::height:
      return {0, 1, 0};
    case Term::degree:
      return {0, 0, 1};
    case Term::all:
      break;
  }
  return {1, options.alpha * scales.alpha, options.beta * scales.beta};
}

}  // namespace

Result<void> check_method(const EdgeCostOptions& method) {
  for (const double weight : {method.alpha, method.beta})
    if (!(weight >= 0 && weight <= 1e15))  // a float holds what they may weigh, too
      return fail(Errc::invalid_argument, "alpha and beta must be numbers >= 0, at most 1e15");
  return {};
}

Result<Simplified> simplify_edge_cost(const Terrain& dem, const EdgeCostOptions& method,
                                      const RunOptions& options, const Progress& progress) {
  if (const auto ok = check_method(method); !ok) return std::unexpected(ok.error());
  Scales scales;
  GridSamples posts;
  posts.cols = dem.grid.cols(), posts.rows = dem.grid.rows();
  posts.z = dem.grid.values().data();
  const bool fits = method.placement == EdgePlacement::fit;
  Result<Simplified> out = collapse_terrain(dem, options, progress, [&](TerrainMesh& terrain) {
    EdgeCost cost(terrain, fits ? fit_samples(posts) : FitSamples());
    scales = scales_of(terrain.mesh, cost);
    cost.set(weights_of(method, scales));
    return cost;
  });
  if (out) {
    out->details["alpha"] = method.alpha;
    out->details["beta"] = method.beta;
    out->details["alpha_scale"] = scales.alpha;
    out->details["beta_scale"] = scales.beta;
  }
  return out;
}

Result<std::uint64_t> collapse_held(HeldMesh& held, const EdgeCostOptions& method,
                                    const Progress& progress) {
  EdgeCost cost(held.terrain, method.placement == EdgePlacement::fit ? held.fit : FitSamples());
  cost.set(weights_of(method, scales_of(held.terrain.mesh, cost)));
  return collapse_within(held, cost, progress);
}

}  // namespace tind
