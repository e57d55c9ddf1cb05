// 1. The fine mesh, from `bounded` at a slightly smaller error, is moved to the lattice: each
// vertex
//    to the nearest place at which its star stays valid, at the height that the surface has there;
//    then heights are fitted anew, because places cost a little.
// 2. The shared collapse engine, with the least possible error of the new star as cost. An edge
//    merges at one of its ends, so no vertex ever leaves the lattice and most records hold no
//    displacement.

#include "terrain/progressive/bounded_collapses.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "terrain/progressive/least_error.h"
#include "terrain/simplify/bounded.h"
#include "terrain/simplify/collapse_method.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;

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
    const Index g = m.twin(h);
    for (const Index v : {m.origin(h), m.dest(h)}) {
      m.for_each_out(v, [&](Index e) {
        const Index t = HalfedgeMesh::triangle(e);
        if (t != HalfedgeMesh::triangle(h) && (g == kNone || t != HalfedgeMesh::triangle(g)))
          fit_.add(m.position(m.dest(e)), m.position(m.apex(e)));
      });
    }
    if (terrain_.kind[end] != VertexKind::fixed) {
      at.z = fit_.best(at.z).z;
      at = lattice_.snap(at);
    }
    return {float(fit_.error_at(at.z)), at};
  }
};

// ---- moving a mesh to a lattice ----

bool star_valid_at(const HalfedgeMesh& m, Index v, const Vec3& at) {
  bool ok = true;
  m.for_each_out(
      v, [&](Index e) { ok = ok && surely_ccw(at, m.position(m.dest(e)), m.position(m.apex(e))); });
  return ok;
}

/// The height of the star of v at a place within it.
double star_height(const HalfedgeMesh& m, Index v, const Vec3& place) {
  const Vec3& c = m.position(v);
  double z = c.z, best = -HUGE_VAL;
  m.for_each_out(v, [&](Index e) {
    const Vec3 &p = m.position(m.dest(e)), &q = m.position(m.apex(e));
    const double area = orient2d(c, p, q);
    const double wc = orient2d(p, q, place) / area, wp = orient2d(q, c, place) / area;
    const double inside = std::min({wc, wp, 1 - wc - wp});
    if (inside > best) best = inside, z = wc * c.z + wp * p.z + (1 - wc - wp) * q.z;
  });
  return z;
}

/// Places around p on the lattice, nearest first; along a side, on it.
std::array<Vec3, 9> places(const Vec3& p, const Lattice& lattice, VertexKind kind) {
  std::array<Vec3, 9> all;
  const Vec3 near = lattice.snap(p);
  const double step = 1 / lattice.per_post;
  int n = 0;
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i)
      all[n++] = {kind == VertexKind::along_y ? p.x : near.x + i * step,
                  kind == VertexKind::along_x ? p.y : near.y + j * step, 0};
  const auto distance = [&](const Vec3& q) { return std::hypot(q.x - p.x, q.y - p.y); };
  std::ranges::stable_sort(all, {}, distance);
  return all;
}

bool move_to_lattice(HalfedgeMesh& m, Index v, VertexKind kind, const Lattice& lattice) {
  for (Vec3 place : places(m.position(v), lattice, kind)) {
    if (!star_valid_at(m, v, place)) continue;
    place.z = star_height(m, v, place);
    m.position(v) = lattice.snap(place);
    return true;
  }
  return false;
}

/// Where a star is too thin for a place on the lattice, another turn after its neighbours have
/// moved helps.
Result<void> move_all_to_lattice(TerrainMesh& terrain, const Lattice& lattice) {
  constexpr int kTurns = 5;
  HalfedgeMesh& m = terrain.mesh;
  std::vector<Index> left;
  for (Index v = 0; v < m.vertex_slots(); ++v) {
    if (terrain.kind[v] == VertexKind::fixed)
      m.position(v) = lattice.snap(m.position(v));
    else
      left.push_back(v);
  }
  for (int turn = 0; turn < kTurns && !left.empty(); ++turn)
    std::erase_if(left, [&](Index v) { return move_to_lattice(m, v, terrain.kind[v], lattice); });
  if (left.empty()) return {};
  return fail(Errc::out_of_range, "a lattice of 1/" + std::to_string(int(lattice.per_post)) +
                                      " post is too coarse for the finest triangles at vertex " +
                                      std::to_string(left[0]) + ": choose a finer one");
}

/// Gives each vertex in turn the height on the lattice that is best for the posts of its star.
void fit_heights(TerrainMesh& terrain, const HeightGrid& grid, const Lattice& lattice) {
  HalfedgeMesh& m = terrain.mesh;
  LeastError fit(grid);
  for (Index v = 0; v < m.vertex_slots(); ++v) {
    Vec3& p = m.position(v);
    fit.start(p);
    m.for_each_out(v, [&](Index e) { fit.add(m.position(m.dest(e)), m.position(m.apex(e))); });
    const Vec3 better = lattice.snap({p.x, p.y, fit.best(p.z).z});
    if (fit.error_at(better.z) < fit.error_at(p.z)) p = better;
  }
}

double largest_error(const HalfedgeMesh& m, const HeightGrid& grid) {
  double worst = 0;
  for (Index h = 0; h < m.halfedge_slots(); h += 3)
    worst = std::max(worst, triangle_error(grid, m.position(m.origin(h)), m.position(m.dest(h)),
                                           m.position(m.apex(h))));
  return worst;
}

/// `bounded` on the lattice. The lattice takes its share of the error: half a step of height, and
/// some for the places, which is not known before; so at most a few tries.
Result<TerrainMesh> fine_mesh(const HeightGrid& grid, double sx, double sy,
                              const SimplifyOptions& options, std::size_t& input_triangles,
                              const Progress& progress) {
  constexpr int kTries = 6, kFits = 3;
  const Lattice& lattice = options.recorder->lattice;
  SimplifyOptions tighter = options;
  if (options.stop.max_error_m && lattice.z_step_m > 0)
    tighter.stop.max_error_m = std::max(0.5 * *options.stop.max_error_m,
                                        *options.stop.max_error_m - 0.6 * lattice.z_step_m);
  for (int i = 0;; ++i) {
    Result<Simplified> made = simplify_bounded(grid, sx, sy, tighter, progress.part(0, 1));
    if (!made) return std::unexpected(made.error());
    input_triangles = made->input_triangles;
    Result<TerrainMesh> terrain = terrain_mesh_of(made->tin, grid.cols(), grid.rows(), sx, sy);
    if (!terrain) return terrain;
    if (const auto ok = move_all_to_lattice(*terrain, lattice); !ok)
      return std::unexpected(ok.error());
    if (!options.stop.max_error_m) return terrain;
    double reached = 0;
    for (int k = 0; k < kFits; ++k) {
      fit_heights(*terrain, grid, lattice);
      reached = largest_error(terrain->mesh, grid);
      if (reached <= *options.stop.max_error_m) return terrain;
    }
    if (i + 1 == kTries) return terrain;
    *tighter.stop.max_error_m *= std::clamp(*options.stop.max_error_m / reached, 0.6, 0.95);
  }
}

}  // namespace

Result<Simplified> record_bounded_collapses(const HeightGrid& grid, double spacing_x_m,
                                            double spacing_y_m, const SimplifyOptions& options,
                                            const Progress& progress) {
  const CollapseRecorder& recorder = *options.recorder;
  std::size_t input_triangles = 0;
  const bool full = options.stop.ratio && *options.stop.ratio == 1;
  Result<TerrainMesh> terrain = full ? terrain_mesh(grid, spacing_x_m, spacing_y_m)
                                     : fine_mesh(grid, spacing_x_m, spacing_y_m, options,
                                                 input_triangles, progress.part(0, 0.5));
  if (!terrain) return std::unexpected(terrain.error());
  if (full) {
    put_on_lattice(terrain->mesh, recorder.lattice);
    input_triangles = terrain->mesh.triangle_count();
  }
  LeastErrorCost cost(grid, *terrain, recorder.lattice);
  NoFlip filter;
  const CollapseRun run =
      record_collapses(terrain->mesh, cost, filter, recorder, progress.part(0.5, 1));
  if (run.cancelled) return fail(Errc::cancelled, "simplification was stopped");
  Simplified out;
  out.steps = run.collapses;
  out.input_triangles = input_triangles;
  out.tin = terrain->mesh.to_tin();
  return out;
}

}  // namespace tind
