#pragma once
// What all collapse methods on a height grid share: build the full mesh, turn StopAt into the
// engine's stop and filter, run the engine, and say how it ended. A method adds only its cost.

#include <cmath>
#include <utility>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/height_grid.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/collapse/collapse_engine.h"
#include "terrain/simplify/collapse/exact_check.h"
#include "terrain/simplify/common/held_mesh.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/common/terrain_mesh.h"

namespace tind {

/// How many triangles `stop` allows of a mesh of `input`; 0 for an error bound.
std::size_t target_triangles(const StopAt& stop, std::size_t input);

/// Why a run that is over stopped short of `stop`; empty when it did not.
std::string stop_note(const StopAt& stop, std::size_t input, std::size_t left);

/// Moves all vertices to the recorder's lattice.
void put_on_lattice(HalfedgeMesh&, const Lattice&);

/// A method's cost whose merged vertices lie on a lattice.
template <class Cost>
class OnLattice {
 public:
  static constexpr bool kOnlyGrows = Cost::kOnlyGrows;

  OnLattice(Cost& cost, const Lattice& lattice) : cost_(cost), lattice_(lattice) {}

  auto estimate(const HalfedgeMesh& m, HalfedgeMesh::Index h) requires Estimates<Cost> {
    return cost_.estimate(m, h);
  }
  Proposal propose(const HalfedgeMesh& m, HalfedgeMesh::Index h) {
    Proposal p = cost_.propose(m, h);
    p.position = lattice_.snap(p.position);
    return p;
  }
  void merge(const HalfedgeMesh& m, HalfedgeMesh::Index h, const Vec3& at) {
    cost_.merge(m, h, at);
  }

 private:
  Cost& cost_;
  Lattice lattice_;
};

/// The second part of a recorded run (CollapseRecorder) where no error bounds it.
template <class Cost, class Filter>
CollapseRun record_collapses(HalfedgeMesh& mesh, Cost& cost, Filter& filter,
                             CollapseRecorder& recorder, const Progress& progress) {
  recorder.fine(mesh);
  const CollapseRun run =
      collapse_edges(mesh, cost, filter, {recorder.triangles, kNever}, progress, &recorder);
  recorder.base(mesh);
  return run;
}

/// The bounds of a recorded run on terrain, in ascending order: those above `from`, up to the first
/// that is at least `to`. 1, 2 and 5 times the powers of ten, and even ratios of about 1.06
/// between.
std::vector<double> error_ladder(double from, double to);

/// Where a recorded run's ladder goes: from the error that its fine end has at most, to the range
/// of all heights.
std::vector<double> error_ladder(const HeightGrid&, const StopAt&, const Lattice&);

/// The second part of a recorded run on terrain. Bound after bound of `ladder`: within each, every
/// collapse that it allows, in the method's own order, before the next one. So a state that is
/// within a bound has nearly as few triangles as a mesh that was made for this bound alone. In the
/// method's order alone, the few places that it rates too low spend the bound of all the others.
/// `bound(e)` makes the filter of the next run; infinity comes last, and all others a hair below
/// the rung, so that the float above what is measured of the mesh is not above the rung.
template <class Cost, class Bound>
CollapseRun record_by_bounds(HalfedgeMesh& mesh, Cost& cost, Bound&& bound,
                             std::vector<double> ladder, CollapseRecorder& recorder,
                             const Progress& progress) {
  recorder.fine(mesh);
  ladder.push_back(HUGE_VAL);
  CollapseRun all;
  for (std::size_t k = 0; k < ladder.size() && !all.reached && !all.cancelled; ++k) {
    auto&& filter = bound(ladder[k] * (1 - 1e-6));
    const double n = double(ladder.size());
    const CollapseRun run =
        collapse_edges(mesh, cost, filter, {recorder.triangles, kNever},
                       progress.part(double(k) / n, double(k + 1) / n), &recorder);
    all.collapses += run.collapses;
    all.reached = run.reached, all.cancelled = run.cancelled;
  }
  recorder.base(mesh);
  return all;
}

/// The engine with the filter that `stop` needs.
template <class Cost>
CollapseRun collapse_until(const StopAt& stop, const HeightGrid& grid, HalfedgeMesh& mesh,
                           Cost& cost, const Progress& progress) {
  const CollapseStop until{target_triangles(stop, mesh.triangle_count()), kNever};
  if (stop.max_error_m) {
    WithinError filter(grid, *stop.max_error_m);
    return collapse_edges(mesh, cost, filter, until, progress);
  }
  NoFlip filter;
  return collapse_edges(mesh, cost, filter, until, progress);
}

/// A method's cost on a held mesh.
template <class Cost>
class OnHeld {
 public:
  static constexpr bool kOnlyGrows = Cost::kOnlyGrows;

  OnHeld(Cost& cost, const HeldMesh& held) : cost_(cost), held_(held) {}

  auto estimate(const HalfedgeMesh& m, HalfedgeMesh::Index h) requires Estimates<Cost> {
    return cost_.estimate(m, h);
  }
  Proposal propose(const HalfedgeMesh& m, HalfedgeMesh::Index h) {
    Proposal p = cost_.propose(m, h);
    if (p.cost < kNever) p.position = held_.placed(m.origin(h), m.dest(h), p.position);
    return p;
  }
  void merge(const HalfedgeMesh& m, HalfedgeMesh::Index h, const Vec3& at) {
    cost_.merge(m, h, at);
  }

 private:
  Cost& cost_;
  const HeldMesh& held_;
};

/// Collapses edges of a held mesh by `cost` until it is enough or none is left that may go. Returns
/// how many.
template <class Cost>
Result<std::uint64_t> collapse_within(HeldMesh& held, Cost& cost, const Progress& progress) {
  OnHeld on_held(cost, held);
  WithinHeld filter(held);
  const CollapseRun run =
      collapse_edges(held.terrain.mesh, on_held, filter, {held.triangles, kNever}, progress);
  if (run.cancelled) return fail(Errc::cancelled, "simplification was stopped");
  return run.collapses;
}

/// `make_cost(TerrainMesh&)` returns the method's Cost (collapse_engine.h). The terrain
/// outlives it.
template <class MakeCost>
Result<Simplified> collapse_terrain(const Terrain& dem, const RunOptions& options,
                                    const Progress& progress, MakeCost&& make_cost) {
  Result<TerrainMesh> terrain = terrain_mesh(dem, options.constraints.get());
  if (!terrain) return std::unexpected(terrain.error());
  HalfedgeMesh& mesh = terrain->mesh;
  Simplified out;
  out.input_triangles = mesh.triangle_count();
  if (options.recorder) put_on_lattice(mesh, options.recorder->lattice);
  auto cost = make_cost(*terrain);
  CollapseRun run;
  if (options.recorder) {
    OnLattice on_lattice(cost, options.recorder->lattice);
    run = collapse_until(options.stop, dem.grid, mesh, on_lattice, progress.part(0, 0.5));
    if (!run.cancelled)
      run = record_by_bounds(
          mesh, on_lattice, [&](double bound) { return WithinError(dem.grid, bound); },
          error_ladder(dem.grid, options.stop, options.recorder->lattice), *options.recorder,
          progress.part(0.5, 1));
  } else {
    run = collapse_until(options.stop, dem.grid, mesh, cost, progress);
  }
  if (run.cancelled) return fail(Errc::cancelled, "simplification was stopped");
  out.steps = run.collapses;
  out.note = stop_note(options.stop, out.input_triangles, mesh.triangle_count());
  out.tin = mesh.to_tin();
  return out;
}

}  // namespace tind
