// The method works on the lattice's whole numbers, so that it can only ever choose positions that
// the stream can hold; its costs do not know the difference.

#include "terrain/progressive/stream/surface_progressive.h"

#include "terrain/progressive/stream/split_recorder.h"
#include "terrain/progressive/stream/surface_measure.h"
#include "terrain/simplify/simplify_mesh.h"

namespace tind {

namespace {

/// From whole numbers to the mesh's own unit. `quantised`: how far the fine end was moved.
void to_units(ProgressiveMesh& pm, const SpaceLattice& lattice, double quantised) {
  for (Vec3& v : pm.base.vertices) v = lattice.place(v);
  for (VertexSplit& s : pm.splits) {
    s.vertex_coarse = lattice.place(s.vertex_coarse);
    s.vertex_fine = lattice.place(s.vertex_fine);
    s.added = lattice.place(s.added);
    s.error_m = rounded_up(double(s.error_m) / lattice.per_unit + quantised);
  }
  pm.fine_error_m = quantised;
}

}  // namespace

Result<ProgressiveSurface> make_progressive_surface(Tin tin, const SimplifyOptions& method,
                                                    std::size_t base_triangles,
                                                    const SpaceLattice& lattice,
                                                    const Progress& progress) {
  double quantised = 0;
  for (Vec3& v : tin.vertices) {
    const Vec3 x = lattice.whole(v);
    quantised = std::max(quantised, length(lattice.place(x) - v));
    v = x;
  }
  SurfaceMeasure measure;
  SplitRecorder splits(measure, {1, 1}, base_triangles);
  SimplifyOptions options = method;
  options.recorder = &splits;
  options.stop = {.ratio = 1};
  const auto made = simplify_mesh(std::move(tin), options, progress);
  if (!made) return std::unexpected(made.error());
  to_units(splits.mesh, lattice, quantised);
  return ProgressiveSurface{std::move(splits.mesh), made->split_vertices, made->dropped_triangles};
}

}  // namespace tind
