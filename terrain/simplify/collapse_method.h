#pragma once
// What all collapse methods on a height grid have in common: build the full mesh, turn StopAt into
// the engine's stop and filter, run, and say how it ended. A method adds its cost.

#include <cmath>
#include <utility>

#include "terrain/simplify/collapse_engine.h"
#include "terrain/simplify/exact_check.h"
#include "terrain/simplify/simplify.h"
#include "terrain/simplify/terrain_mesh.h"

namespace tind {

/// The triangle count that `stop` asks of a mesh of `input` triangles; 0 for an error bound.
std::size_t target_triangles(const StopAt& stop, std::size_t input);

/// Why a run that is over stopped short of `stop`; empty when it did not.
std::string stop_note(const StopAt& stop, std::size_t input, std::size_t left);

/// `make_cost(TerrainMesh&)` returns the method's Cost (collapse_engine.h). The terrain outlives
/// it.
template <class MakeCost>
Result<Simplified> collapse_terrain(const HeightGrid& grid, double spacing_x_m, double spacing_y_m,
                                    const StopAt& stop, const Progress& progress,
                                    MakeCost&& make_cost) {
  Result<TerrainMesh> terrain = terrain_mesh(grid, spacing_x_m, spacing_y_m);
  if (!terrain) return std::unexpected(terrain.error());
  HalfedgeMesh& mesh = terrain->mesh;
  Simplified out;
  out.input_triangles = mesh.triangle_count();
  auto cost = make_cost(*terrain);
  const CollapseStop until{target_triangles(stop, mesh.triangle_count()), kNever};
  CollapseRun run;
  if (stop.max_error_m) {
    WithinError filter(grid, *stop.max_error_m);
    run = collapse_edges(mesh, cost, filter, until, progress);
  } else {
    NoFlip filter;
    run = collapse_edges(mesh, cost, filter, until, progress);
  }
  if (run.cancelled) return fail(Errc::cancelled, "simplification was stopped");
  out.steps = run.collapses;
  out.note = stop_note(stop, out.input_triangles, mesh.triangle_count());
  out.tin = mesh.to_tin();
  return out;
}

}  // namespace tind
