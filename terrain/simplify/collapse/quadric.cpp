// Quadrics are kept relative to their own vertex: near the vertex all numbers are small, so float
// is enough, a quadric is 40 bytes, and a fresh one is only its 3 x 3 matrix (all planes pass
// through the vertex). Moving to another origin is a matrix-vector product.
//
// Each vertex also carries a weak spring to where it started (kQemSpring of its area). It makes
// every matrix invertible, so there is no singular case, and on plains, where all quadrics vanish,
// it prefers short edges, so that plains thin out evenly.

#include "terrain/simplify/collapse/quadric.h"

#include <array>
#include <cmath>
#include <vector>

#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/simplify/collapse/quadric_n.h"
#include "terrain/simplify/common/springs.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;

constexpr double kBorderWeight = 10;

using Quadric = QuadricN<3>;
using Vec3f = std::array<float, 3>;  // relative to a quadric's origin, metres

class QuadricCost {
 public:
  static constexpr bool kOnlyGrows = true;

  QuadricCost(TerrainMesh& terrain, bool subset, bool border_constraints)
      : terrain_(terrain), subset_(subset), quadric_(terrain.mesh.vertex_slots()) {
    const HalfedgeMesh& m = terrain.mesh;
    for (Index t = 0; t < m.triangle_slots(); ++t) add_triangle(m, 3 * t);
    if (border_constraints)
      for (Index h = 0; h < m.halfedge_slots(); ++h)
        if (m.twin(h) == kNone) add_border(m, h);
  }

  [[gnu::always_inline]] void prefetch(Index v) const {
    __builtin_prefetch(&quadric_[v]);
    __builtin_prefetch(&terrain_.kind[v]);
  }

  Proposal propose(const HalfedgeMesh& m, Index h) const {
    const Merge rule = merge_rule(terrain_, h);
    if (rule == Merge::never) return {};
    const Index a = m.origin(h), b = m.dest(h);
    const Vec3 &pa = m.position(a), &pb = m.position(b);
    const Vec3f ab = offset(pa, pb);
    Quadric q = quadric_[b];  // brought to the origin of a
    q.move_origin({-ab[0], -ab[1], -ab[2]});
    q.add(quadric_[a]);
    if (subset_ || rule == Merge::either) return subset_placement(q, rule, pa, pb, ab);
    return optimal_placement(q, rule, a, b, pa, pb, ab);
  }

  void merge(const HalfedgeMesh& m, Index h, const Vec3& at) {
    const Index a = m.origin(h), b = m.dest(h);
    merge_vertices(terrain_, a, b);
    quadric_[a].move_origin(offset(m.position(a), at));
    quadric_[b].move_origin(offset(m.position(b), at));
    quadric_[b].add(quadric_[a]);
  }

 private:
  TerrainMesh& terrain_;
  bool subset_;
  std::vector<Quadric> quadric_;

  Vec3f offset(const Vec3& from, const Vec3& to) const {
    return {float((to.x - from.x) * terrain_.metres_x), float((to.y - from.y) * terrain_.metres_y),
            float(to.z - from.z)};
  }

  void add_triangle(const HalfedgeMesh& m, Index h) {
    const Vec3 a = terrain_.metric(m.position(m.origin(h)));
    const Vec3 n = cross(terrain_.metric(m.position(m.dest(h))) - a,
                         terrain_.metric(m.position(m.apex(h))) - a);
    const double area2 = length(n);
    const float spring = float(0.5 * n.z / 3) * float(kQemSpring);
    // The area times the squared unit normal.
    const Quadric q = Quadric::of_plane({n.x, n.y, n.z}, 0.5 * n.z / area2 / area2, spring);
    for (Index e = h; e < h + 3; ++e) quadric_[m.origin(e)].add(q);
  }

  void add_border(const HalfedgeMesh& m, Index h) {
    const Vec3 a = terrain_.metric(m.position(m.origin(h)));
    const Vec3 along = terrain_.metric(m.position(m.dest(h))) - a;
    const Vec3 n = cross(along, terrain_.metric(m.position(m.apex(h))) - a);
    const Vec3 out = cross(along, n);
    const double weight = kBorderWeight * dot(along, along) / dot(out, out);
    const Quadric wall = Quadric::of_plane({out.x, out.y, out.z}, weight, 0);
    quadric_[m.origin(h)].add(wall);
    quadric_[m.dest(h)].add(wall);
  }

  static float clean(float cost) { return cost > 0 ? cost : 0; }

  Proposal subset_placement(const Quadric& q, Merge rule, const Vec3& pa, const Vec3& pb,
                            const Vec3f& ab) const {
    const float at_a = clean(q.c), at_b = clean(q.value(ab));
    if (rule == Merge::at_origin) return {at_a, pa};
    if (rule == Merge::at_dest) return {at_b, pb};
    return at_a < at_b ? Proposal{at_a, pa} : Proposal{at_b, pb};
  }

  Proposal optimal_placement(const Quadric& q, Merge rule, Index a, Index b, const Vec3& pa,
                             const Vec3& pb, const Vec3f& ab) const {
    Vec3 at;
    bool height_free = true;
    switch (rule) {
      case Merge::at_origin:
        at = pa;
        height_free = !height_is_fixed(terrain_.kind[a]);
        break;
      case Merge::at_dest:
        at = pb;
        height_free = !height_is_fixed(terrain_.kind[b]);
        break;
      case Merge::along_x:
      case Merge::along_y:
        at = least_on_side(q, rule, pa, pb);
        break;
      default: {
        const Vec3f v = q.least();
        const double reach = 4 * (double(ab[0]) * ab[0] + double(ab[1]) * ab[1]);
        const bool near = double(v[0]) * v[0] + double(v[1]) * v[1] <= reach;
        at = near ? Vec3{pa.x + v[0] / terrain_.metres_x, pa.y + v[1] / terrain_.metres_y, pa.z}
                  : Vec3{(pa.x + pb.x) / 2, (pa.y + pb.y) / 2, pa.z};
        at.x = snap_to_lattice(at.x);
        at.y = snap_to_lattice(at.y);
      }
    }
    Vec3f v = offset(pa, at);
    if (height_free) {
      v[2] = q.least_third(v[0], v[1]);
      at.z = pa.z + v[2];
    }
    return {clean(q.value(v)), at};
  }

  /// On a side one coordinate is given (both ends have it), and the place along the side is least
  /// for the best height there: two unknowns, and kept between the two ends.
  Vec3 least_on_side(const Quadric& q, Merge rule, const Vec3& pa, const Vec3& pb) const {
    const bool x = rule == Merge::along_x;
    const int k = x ? 0 : 1;
    const float ss = q(k, k), sz = q(k, 2), zz = q(2, 2);
    const float s = (q.b[2] * sz - q.b[k] * zz) / (ss * zz - sz * sz);
    Vec3 at = pa;
    const double place = (x ? pa.x : pa.y) + s / (x ? terrain_.metres_x : terrain_.metres_y);
    const auto [low, high] = x ? std::minmax(pa.x, pb.x) : std::minmax(pa.y, pb.y);
    (x ? at.x : at.y) = snap_to_lattice(std::clamp(place, low, high));
    return at;
  }
};

}  // namespace

Result<Simplified> simplify_qem(const Terrain& dem, const QemOptions& method,
                                const RunOptions& options, const Progress& progress) {
  return collapse_terrain(dem, options, progress, [&](TerrainMesh& terrain) {
    return QuadricCost(terrain, method.subset_placement, method.border_constraints);
  });
}

Result<std::uint64_t> collapse_held(HeldMesh& held, const QemOptions& method,
                                    const Progress& progress) {
  QuadricCost cost(held.terrain, method.subset_placement, method.border_constraints);
  return collapse_within(held, cost, progress);
}

}  // namespace tind
