#pragma once
// A mesh that collapse methods are given instead of a DEM's own: a tile's, in the tile's frame,
// whose border and lines are held; or a TIN. The bound is one that somebody else knows.

#include <cmath>
#include <functional>
#include <memory>

#include "terrain/simplify/common/held_colours.h"
#include "terrain/simplify/common/star_fit.h"
#include "terrain/simplify/common/terrain_mesh.h"

namespace tind {

/// Vertices of VertexKind::fixed stay where they are, and so do all edges between two of them: no
/// collapse of another edge takes one away. Of a tile all others are interior.
struct HeldMesh {
  TerrainMesh terrain;
  std::size_t triangles = 0;  // it is enough as soon as at most so many are left
  /// Merged vertices stand on multiples of place_step (0: where the method puts them), whole
  /// numbers at least; their heights are multiples of height_step (0: any) between the two limits.
  double place_step = 1, height_step = 0;
  double height_min = -HUGE_VAL, height_max = HUGE_VAL;
  /// Whether the surface may have this triangle (counter-clockwise): nothing that is to be near it
  /// is farther than the bound. Empty: there is no bound.
  std::function<bool(const Vec3&, const Vec3&, const Vec3&)> within;

  FitSamples fit = {};  // what lies in a triangle; only for methods that ask for it

  /// What its vertices are to show; null: nothing. Only for methods that ask for it. They say how
  /// much of that a triangle that comes of a collapse may show wrongly (HeldColours::error).
  std::shared_ptr<const HeldColours> colours = {};
  double colour_bound = HUGE_VAL;

  bool interior(HalfedgeMesh::Index v) const { return terrain.kind[v] == VertexKind::interior; }

  /// Where a vertex may be that merges at p; a place of whole numbers is one already.
  Vec3 snap(const Vec3& p) const {
    const auto whole = [](double v) { return v == std::nearbyint(v); };
    const auto on_step = [](double v, double step) { return std::nearbyint(v / step) * step; };
    Vec3 at = p;
    if (place_step > 0 && (!whole(p.x) || !whole(p.y)))
      at = {on_step(p.x, place_step), on_step(p.y, place_step), p.z};
    if (height_step > 0) at.z = on_step(at.z, height_step);
    at.z = std::min(std::max(at.z, height_min), height_max);
    return at;
  }

  /// Where the ends a and b merge when a method says p: an end that is held stays to the bit.
  Vec3 placed(HalfedgeMesh::Index a, HalfedgeMesh::Index b, const Vec3& p) const {
    return interior(a) && interior(b) ? snap(p) : p;
  }
};

/// The filter of a held mesh: nothing flips, nothing leaves the bounds.
class WithinHeld {
 public:
  explicit WithinHeld(const HeldMesh& held) : held_(held) {}

  bool allows(const HalfedgeMesh& m, HalfedgeMesh::Index h, const Vec3& at) const {
    return star_stays_ccw(m, h, at) &&
           (!held_.within || m.all_kept(h,
                                        [&](HalfedgeMesh::Index e) {
                                          return held_.within(at, m.position(m.dest(e)),
                                                              m.position(m.apex(e)));
                                        })) &&
           (!coloured() || m.all_kept(h, [&](HalfedgeMesh::Index e) {
             return held_.colours->error(at, m.position(m.dest(e)), m.position(m.apex(e))) <=
                    held_.colour_bound;
           }));
  }
  /// One triangle, colours aside. REQUIRES: counter-clockwise.
  bool holds(const Vec3& a, const Vec3& b, const Vec3& c) const {
    return !held_.within || held_.within(a, b, c);
  }

 private:
  const HeldMesh& held_;

  bool coloured() const { return held_.colours && held_.colour_bound < HUGE_VAL; }
};

}  // namespace tind
