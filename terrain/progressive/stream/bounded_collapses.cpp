// The shared collapse engine, with the least possible error of the new star as cost. An edge merges
// at one of its ends, where only the height is new: so no vertex ever leaves the posts, and most
// records hold no displacement.

#include "terrain/progressive/stream/bounded_collapses.h"

#include "terrain/progressive/stream/least_error.h"
#include "terrain/simplify/collapse/collapse_method.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;

class LeastErrorCost {
 public:
  static constexpr bool kOnlyGrows = true;

  LeastErrorCost(const HeightGrid& grid, TerrainMesh& terrain, const Lattice& lattice)
      : terrain_(terrain), lattice_(lattice), fit_(grid) {}

  Proposal propose(const HalfedgeMesh& m, Index h) {
    const Index a = m.origin(h), b = m.dest(h);
    switch (merge_rule(terrain_, h)) {
      case Merge::never:
        return {};
      case Merge::at_origin:
        return at_end(m, h, a);
      case Merge::at_dest:
        return at_end(m, h, b);
      default: {
        const Proposal p = at_end(m, h, a), q = at_end(m, h, b);
        return p.cost < q.cost ? p : q;
      }
    }
  }

  void merge(const HalfedgeMesh& m, Index h, const Vec3&) {
    VertexKind& b = terrain_.kind[m.dest(h)];
    b = merged_kind(terrain_.kind[m.origin(h)], b);
  }

 private:
  TerrainMesh& terrain_;
  Lattice lattice_;
  LeastError fit_;

  Proposal at_end(const HalfedgeMesh& m, Index h, Index end) {
    Vec3 at = m.position(end);
    if (!star_stays_ccw(m, h, at)) return {};
    fit_.start(at);
    m.for_each_kept(h, [&](Index e) { fit_.add(m.position(m.dest(e)), m.position(m.apex(e))); });
    if (terrain_.kind[end] != VertexKind::fixed) {
      at.z = fit_.best(at.z).z;
      at = lattice_.snap(at);
    }
    return {float(fit_.error_at(at.z)), at};
  }
};

}  // namespace

Result<Simplified> record_bounded_collapses(const Terrain& dem, const RunOptions& options,
                                            const Progress& progress) {
  return collapse_terrain(dem, options, progress, [&](TerrainMesh& terrain) {
    return LeastErrorCost(dem.grid, terrain, options.recorder->lattice);
  });
}

}  // namespace tind
