#pragma once
// Where a merged vertex may go and where it is best. Methods that work on terrain and on general
// meshes use two sets of rules with the same interface:
//
//   Merge rule(Index h)             where the merged vertex of an edge may be, by its two ends
//   void merged(Index a, Index b)   a has been merged into b
//   Vec3 metric(Vec3 difference)    of positions, to the frame in which distances make sense
//   Vec3 unmetric(Vec3)             and back
//   Vec3 snap(Vec3)                 to the positions that this kind of mesh allows
//   Vec3 on_lattice(Index a, Index b, Vec3)
//                                   where a and b merge, to a recorder's lattice or a held mesh's
//   void bound(double)              from now on, of triangles that are new; infinity: none
//   ladder(StopAt, Lattice)         the bounds of a recorder's second part
//   bool allows(mesh, h, at)        the engine's filter: the star of a collapse stays valid
//   bool allows_triangle(was, now)  the same for one triangle of it
//
// place_merged places the vertex of an edge by these rules, over quadrics of any dimension.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "terrain/raster/height_grid.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/collapse/collapse_engine.h"
#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/simplify/collapse/exact_check.h"
#include "terrain/simplify/collapse/quadric_n.h"
#include "terrain/simplify/common/held_mesh.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/terrain_mesh.h"

namespace tind {

using Triangle3 = std::array<Vec3, 3>;

/// Terrain: valid seen from above, sides stay straight, and within a bound if one is given.
class TerrainRules {
 public:
  using Index = HalfedgeMesh::Index;
  static constexpr int kPlanar = 2;  // x and y are decided first, the height follows

  TerrainRules(TerrainMesh& terrain, const HeightGrid& grid, std::optional<double> max_error)
      : terrain_(terrain), grid_(&grid) {
    if (max_error) bound(*max_error);
  }
  explicit TerrainRules(HeldMesh& held) : terrain_(held.terrain), held_(&held) {}

  void bound(double max_error) {
    bound_.reset();
    if (std::isfinite(max_error)) bound_.emplace(*grid_, max_error);
  }
  std::vector<double> ladder(const StopAt& stop, const Lattice& lattice) const {
    return error_ladder(*grid_, stop, lattice);
  }
  void put_on(const Lattice& lattice) { lattice_ = lattice; }

  Merge rule(Index h) const { return merge_rule(terrain_, h); }
  bool height_is_fixed(Index v) const { return tind::height_is_fixed(terrain_.kind[v]); }
  bool interior(Index v) const { return terrain_.kind[v] == VertexKind::interior; }
  void merged(Index a, Index b) { merge_vertices(terrain_, a, b); }
  Vec3 metric(const Vec3& d) const { return terrain_.metric(d); }
  Vec3 unmetric(const Vec3& d) const {
    return {d.x / terrain_.metres_x, d.y / terrain_.metres_y, d.z};
  }
  Vec3 snap(const Vec3& p) const { return {snap_to_lattice(p.x), snap_to_lattice(p.y), p.z}; }
  Vec3 on_lattice(Index a, Index b, const Vec3& p) const {
    if (held_) return held_->placed(a, b, p);
    return lattice_ ? lattice_->snap(p) : p;
  }
  bool allows(const HalfedgeMesh& mesh, Index h, const Vec3& at) const {
    if (held_) return WithinHeld(*held_).allows(mesh, h, at);
    return bound_ ? bound_->allows(mesh, h, at) : star_stays_ccw(mesh, h, at);
  }
  bool allows_triangle(const Triangle3&, const Triangle3& now) const {
    if (!surely_ccw(now[0], now[1], now[2])) return false;
    if (held_) return WithinHeld(*held_).holds(now[0], now[1], now[2]);
    return !bound_ || bound_->holds(now[0], now[1], now[2]);
  }

 private:
  TerrainMesh& terrain_;
  const HeightGrid* grid_ = nullptr;
  const HeldMesh* held_ = nullptr;
  std::optional<WithinError> bound_;
  std::optional<Lattice> lattice_;
};

/// In Simplified::details of a general mesh.
inline constexpr const char* kSeamVertices = "seam_vertices";

/// A general mesh: no normal turns by 90 degrees or more, borders stay borders. Where two vertices
/// of borders are at one place (a seam, at which the attributes change), both stay there, and so
/// does what merges with them: no crack opens.
class SurfaceRules {
 public:
  using Index = HalfedgeMesh::Index;
  static constexpr int kPlanar = 3;

  explicit SurfaceRules(const HalfedgeMesh& mesh) : mesh_(mesh), seam_(seams(mesh)) {}

  Merge rule(Index h) const {
    bool a = on_seam(mesh_.origin(h)), b = on_seam(mesh_.dest(h));
    if (mesh_.twin(h) != HalfedgeMesh::kNone)
      a = a || mesh_.on_border(mesh_.origin(h)), b = b || mesh_.on_border(mesh_.dest(h));
    if (a && b) return Merge::never;
    return a ? Merge::at_origin : b ? Merge::at_dest : Merge::free;
  }
  bool height_is_fixed(Index) const { return true; }
  bool interior(Index v) const { return !mesh_.on_border(v); }
  bool on_seam(Index v) const { return seam_[v] != 0; }
  std::size_t seam_vertices() const { return std::size_t(std::ranges::count(seam_, 1)); }
  void merged(Index a, Index b) { seam_[b] |= seam_[a]; }
  Vec3 metric(const Vec3& d) const { return d; }
  Vec3 unmetric(const Vec3& d) const { return d; }
  Vec3 snap(const Vec3& p) const { return p; }
  Vec3 on_lattice(Index, Index, const Vec3& p) const { return lattice_ ? lattice_->snap(p) : p; }
  void put_on(const Lattice& lattice) { lattice_ = lattice; }
  void bound(double) {}
  std::vector<double> ladder(const StopAt&, const Lattice&) const { return {}; }
  bool allows(const HalfedgeMesh& mesh, Index h, const Vec3& at) const;
  bool allows_triangle(const Triangle3& was, const Triangle3& now) const {
    const Vec3 before = cross(was[1] - was[0], was[2] - was[0]);
    const Vec3 after = cross(now[1] - now[0], now[2] - now[0]);
    // A triangle that had no area may become anything.
    return dot(before, after) > 0 || dot(before, before) == 0;
  }

 private:
  const HalfedgeMesh& mesh_;
  std::vector<std::uint8_t> seam_;  // by vertex
  std::optional<Lattice> lattice_;

  static std::vector<std::uint8_t> seams(const HalfedgeMesh&);
};

template <int N>
using OffsetN = std::array<float, N>;

template <int N>
struct Placed {
  float cost = kNever;
  Vec3 at;       // the position
  OffsetN<N> d;  // the point, relative to the origin of the quadric
};

template <class Rules>
Vec3 metric_offset(const Rules& rules, const Vec3& from, const Vec3& to) {
  return rules.metric(to - from);
}

/// The best point at a given position: what is not position is solved for. A terrain vertex whose
/// height is free gets its best height too.
template <int N, class Rules>
Placed<N> place_at(const Rules& rules, const QuadricN<N>& q, const Vec3& origin, const Vec3& at,
                   bool height_free) {
  Placed<N> p;
  p.at = at;
  const Vec3 m = metric_offset(rules, origin, at);
  p.d[0] = float(m.x), p.d[1] = float(m.y), p.d[2] = float(m.z);
  const int given = height_free && Rules::kPlanar == 2 ? 2 : 3;
  q.least(p.d, given);
  if (given == 2) p.at.z = origin.z + double(p.d[2]);
  p.cost = std::max(0.0f, q.value(p.d));
  return p;
}

/// The best point of all. When it lies farther than `reach` (metres, squared), the quadric says
/// little about where: then the best one above, or at, the position `otherwise`.
template <int N, class Rules>
Placed<N> place_free(const Rules& rules, const QuadricN<N>& q, const Vec3& origin, double reach,
                     const Vec3& otherwise) {
  Placed<N> p;
  q.least(p.d, 0);
  double far = 0;
  for (int i = 0; i < Rules::kPlanar; ++i) far += double(p.d[i]) * p.d[i];
  if (!(far <= reach)) return place_at<N>(rules, q, origin, rules.snap(otherwise), true);
  p.at = origin + rules.unmetric({p.d[0], p.d[1], p.d[2]});
  if constexpr (Rules::kPlanar == 2) {  // snapping moves it by a thousandth of a post
    const double z = p.at.z;
    p.at = rules.snap(p.at);
    p.at.z = z;
  }
  p.cost = std::max(0.0f, q.value(p.d));
  return p;
}

/// Where an edge from a (the quadric's origin) to b merges best under its rule.
template <int N, class Rules>
Placed<N> place_merged(const Rules& rules, Merge rule, const QuadricN<N>& q,
                       const HalfedgeMesh& mesh, HalfedgeMesh::Index a, HalfedgeMesh::Index b) {
  const Vec3 &pa = mesh.position(a), &pb = mesh.position(b);
  switch (rule) {
    case Merge::never:
      return {};
    case Merge::at_origin:
      return place_at<N>(rules, q, pa, pa, !rules.height_is_fixed(a));
    case Merge::at_dest:
      return place_at<N>(rules, q, pa, pb, !rules.height_is_fixed(b));
    case Merge::either: {
      const Placed<N> at_a = place_at<N>(rules, q, pa, pa, false);
      const Placed<N> at_b = place_at<N>(rules, q, pa, pb, false);
      return at_a.cost < at_b.cost ? at_a : at_b;
    }
    case Merge::along_x:
    case Merge::along_y: {
      // Along the side the least cost is a parabola: three values give its lowest point.
      const auto on_side = [&](const Vec3& p) {  // which a TIN need not have on the lattice
        const Vec3 at = rules.snap(p);
        return rule == Merge::along_x ? Vec3{at.x, pa.y, at.z} : Vec3{pa.x, at.y, at.z};
      };
      const Vec3 middle = on_side({(pa.x + pb.x) / 2, (pa.y + pb.y) / 2, pa.z});
      const Placed<N> ends[3] = {place_at<N>(rules, q, pa, pa, true),
                                 place_at<N>(rules, q, pa, middle, true),
                                 place_at<N>(rules, q, pa, pb, true)};
      const double bend = double(ends[0].cost) - 2 * ends[1].cost + ends[2].cost;
      const double slope = double(ends[2].cost) - ends[0].cost;
      const double s = bend > 0 ? std::clamp(0.5 - slope / (4 * bend), 0.0, 1.0) : 0.5;
      const Vec3 there = on_side({pa.x + s * (pb.x - pa.x), pa.y + s * (pb.y - pa.y), pa.z});
      return place_at<N>(rules, q, pa, there, true);
    }
    case Merge::free:
      break;
  }
  const Vec3 ab = metric_offset(rules, pa, pb);
  double reach = ab.x * ab.x + ab.y * ab.y;
  if (Rules::kPlanar == 3) reach += ab.z * ab.z;
  return place_free<N>(rules, q, pa, 4 * reach, (pa + pb) * 0.5);
}

}  // namespace tind
