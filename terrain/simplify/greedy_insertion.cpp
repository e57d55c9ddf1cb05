#include "terrain/simplify/greedy_insertion.h"

#include <algorithm>
#include <cmath>

#include "terrain/simplify/delaunay_insertion.h"

namespace tind {

Result<Simplified> simplify_greedy(const HeightGrid& grid, double spacing_x_m, double spacing_y_m,
                                   const SimplifyOptions& o, const Progress& progress) {
  const auto first = std::ranges::find_if(grid.values(), [](float z) { return !std::isnan(z); });
  if (first == grid.values().end())
    return fail(Errc::bad_data, "the grid holds no valid height at all");
  GridSamples samples;
  samples.cols = grid.cols();
  samples.rows = grid.rows();
  samples.z = grid.values().data();
  // A void corner takes any valid height: no sample asks anything of it.
  auto corner = [&](int c, int r) {
    const float z = grid.at(c, r);
    return Vec3{double(c), -double(r), std::isnan(z) ? *first : z};
  };
  Tin two;
  two.vertices = {corner(0, grid.rows() - 1), corner(grid.cols() - 1, grid.rows() - 1),
                  corner(grid.cols() - 1, 0), corner(0, 0)};
  two.triangles = {{0, 1, 2}, {0, 2, 3}};
  HalfedgeMesh mesh = *HalfedgeMesh::from_tin(two);
  InsertionOptions options;
  options.x_scale = delaunay_x_scale(spacing_x_m, spacing_y_m);
  // Heights of integer DEMs miss the mesh by exactly M in many places: those are within it.
  if (o.stop.max_error_m) options.limit = *o.stop.max_error_m;
  options.limit = std::max(options.limit, 1e-9);
  const double full = 2.0 * (grid.cols() - 1) * (grid.rows() - 1);
  std::uint64_t count = ~std::uint64_t(0);
  if (o.stop.triangles) count = *o.stop.triangles;
  if (o.stop.ratio) count = std::uint64_t(std::floor(*o.stop.ratio * full));
  DelaunayInsertion<GridSamples> insertion(mesh, samples, options);
  // An insertion adds two triangles, so the last one may be one too many for an odd count.
  insertion.run_worst_first(count == ~std::uint64_t(0) ? count : count - (count > 2), progress);
  if (progress.stopped()) return fail(Errc::cancelled, "stopped");
  Simplified result;
  result.tin = mesh.to_tin();
  result.steps = insertion.insertions();
  result.input_triangles = std::uint64_t(full);
  if (count != ~std::uint64_t(0) && result.tin.triangles.size() != count) {
    result.note = result.tin.triangles.size() < count
                      ? "no sample is left that the mesh does not pass through"
                      : "an insertion adds two triangles";
  }
  return result;
}

}  // namespace tind
