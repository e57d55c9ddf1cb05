// The shared collapse engine, with the squared error of the samples as cost and the bound as cap.

#include "terrain/progressive/stream/bounded_collapses.h"

#include "terrain/simplify/bounded/squared_error.h"
#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/simplify/common/samples.h"

namespace tind {

Result<Simplified> record_bounded_collapses(const Terrain& dem, const RunOptions& options,
                                            const Progress& progress) {
  Result<TerrainMesh> terrain = terrain_mesh(dem, options.constraints.get());
  if (!terrain) return std::unexpected(terrain.error());
  HalfedgeMesh& mesh = terrain->mesh;
  CollapseRecorder& recorder = *options.recorder;
  put_on_lattice(mesh, recorder.lattice);
  GridSamples samples;
  samples.cols = dem.grid.cols(), samples.rows = dem.grid.rows();
  samples.z = dem.grid.values().data();
  SquaredError<GridSamples> error(*terrain, samples,
                                  options.stop.max_error_m.value_or(HUGE_VAL) * (1 - 1e-9), true);
  OnLattice cost(error, recorder.lattice);
  Simplified out;
  out.input_triangles = mesh.triangle_count();
  const CollapseStop until{target_triangles(options.stop, out.input_triangles), kNever};
  CollapseRun run = collapse_edges(mesh, cost, error, until, progress.part(0, 0.3));
  if (!run.cancelled) {
    const auto bound = [&](double e) -> SquaredError<GridSamples>& {
      error.raise_cap(e);
      return error;
    };
    run =
        record_by_bounds(mesh, cost, bound, error_ladder(dem.grid, options.stop, recorder.lattice),
                         recorder, progress.part(0.3, 1));
  }
  if (run.cancelled) return fail(Errc::cancelled, "simplification was stopped");
  out.steps = run.collapses;
  out.tin = mesh.to_tin();
  return out;
}

}  // namespace tind
