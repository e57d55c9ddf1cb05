// Insert, collapse, fit (squared_error.h). The cap is the error of the worst sample when insertion
// has reached the wanted count.

#include "terrain/simplify/bounded/bounded_count.h"

#include <algorithm>
#include <cmath>

#include "terrain/simplify/bounded/squared_error.h"
#include "terrain/simplify/collapse/collapse_engine.h"
#include "terrain/simplify/common/terrain_mesh.h"
#include "terrain/simplify/insertion/delaunay_insertion.h"

namespace tind {

template <class Samples>
Result<CountResult> fit_to_count(const Tin& start, const Samples& samples, const CountOptions& o,
                                 const Progress& progress) {
  auto mesh = HalfedgeMesh::from_tin(start);
  if (!mesh) return std::unexpected(mesh.error());
  InsertionOptions insertion_options;
  insertion_options.x_scale = o.x_scale;
  insertion_options.limit = 1e-9;
  insertion_options.any_place = o.any_place;
  CountResult result;
  Tin fine;
  {
    DelaunayInsertion<Samples> insertion(*mesh, samples, insertion_options);
    // One insertion farther back than greedy looks: its error is never below this one then.
    insertion.run_to_low(o.triangles, insertions_back(o.triangles) + 1, progress);
    result.max_error_m = std::max(insertion.remaining_error(), 1e-6);
    insertion.run_worst_first(std::size_t(o.surplus * double(o.triangles)), progress);
    fine = mesh->to_tin();
  }
  progress.at(0.25);
  auto terrain = terrain_mesh_of(fine, o.x_scale, 1);
  if (!terrain) return std::unexpected(terrain.error());
  SquaredError error(*terrain, samples, result.max_error_m);
  const CollapseStop stop{o.triangles, kNever};
  for (;;) {
    const CollapseRun run =
        collapse_edges(terrain->mesh, error, error, stop, progress.part(0.25, 0.8));
    result.collapses += run.collapses;
    if (run.cancelled || progress.stopped()) return fail(Errc::cancelled, "stopped");
    if (run.reached || !(error.cap() < HUGE_VAL)) break;
    // Nothing is left that the cap allows: the count comes first.
    error.raise_cap(error.cap() < 1e6 ? error.cap() * 1.25 : HUGE_VAL);
  }
  for (int k = 0; k < o.rounds && !progress.stopped(); ++k) {
    progress.at(0.8 + 0.2 * k / o.rounds);
    error.fit_vertices();
    error.flip_edges();
  }
  if (progress.stopped()) return fail(Errc::cancelled, "stopped");
  result.max_error_m = error.cap();
  result.tin = terrain->mesh.to_tin();
  return result;
}

template Result<CountResult> fit_to_count(const Tin&, const GridSamples&, const CountOptions&,
                                          const Progress&);
template Result<CountResult> fit_to_count(const Tin&, const ScatteredSamples&, const CountOptions&,
                                          const Progress&);

}  // namespace tind
