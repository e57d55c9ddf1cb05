#include "terrain/simplify/insertion/greedy_insertion.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/simplify/insertion/coarse_constrained.h"
#include "terrain/simplify/insertion/delaunay_insertion.h"

namespace tind {

namespace {

/// Two triangles over all of the grid.
Result<HalfedgeMesh> two_triangles(const HeightGrid& grid) {
  const auto first = std::ranges::find_if(grid.values(), [](float z) { return !std::isnan(z); });
  if (first == grid.values().end())
    return fail(Errc::bad_data, "the grid holds no valid height at all");
  // A void corner takes any valid height: no sample asks anything of it.
  auto corner = [&](int c, int r) {
    const float z = grid.at(c, r);
    return Vec3{double(c), -double(r), std::isnan(z) ? *first : z};
  };
  Tin two;
  two.vertices = {corner(0, grid.rows() - 1), corner(grid.cols() - 1, grid.rows() - 1),
                  corner(grid.cols() - 1, 0), corner(0, 0)};
  two.triangles = {{0, 1, 2}, {0, 2, 3}};
  return HalfedgeMesh::from_tin(two);
}

/// What the insertion starts from; with lines, it has them as edges already.
Result<CoarseConstrained> start(const HeightGrid& grid, const RunOptions& o) {
  if (o.constraints) return coarse_constrained(*o.constraints);
  Result<HalfedgeMesh> two = two_triangles(grid);
  if (!two) return std::unexpected(two.error());
  return CoarseConstrained{std::move(*two), {}, {}};
}

std::string count_note(std::size_t left, std::uint64_t count, std::size_t at_start, bool exact,
                       bool lines) {
  if (left == count) return {};
  if (left > count && left == 2) return "the rectangle alone needs 2 triangles";
  if (left < count && exact) return "no sample is left that the mesh does not pass through";
  if (left + 2 < count)
    return std::to_string(left) + " triangles, not " + std::to_string(count) +
           ": a few insertions more would leave a larger error";
  if (left == at_start && left > 2)
    return lines ? edges_alone_note(left)
                 : "the outline alone needs " + std::to_string(left) + " triangles";
  return "an insertion adds two triangles";
}

/// Inserts into `mesh`, of which `full` triangles would be all, until it is enough.
template <class Samples>
Result<Simplified> grow(HalfedgeMesh& mesh, const Samples& samples, LinePoints* lines,
                        double x_scale, std::uint64_t full, const RunOptions& o,
                        const Progress& progress) {
  InsertionOptions options;
  options.x_scale = x_scale;
  options.any_place = std::is_same_v<Samples, ScatteredSamples>;
  // Heights of integer DEMs miss the mesh by exactly M in many places: those are within it.
  if (o.stop.max_error_m) options.limit = *o.stop.max_error_m;
  options.limit = std::max(options.limit, 1e-9);
  std::uint64_t count = ~std::uint64_t(0);
  if (o.stop.triangles) count = *o.stop.triangles;
  if (o.stop.ratio) count = target_triangles(o.stop, std::size_t(full));
  DelaunayInsertion<Samples> insertion(mesh, samples, options);
  if (lines) insertion.keep(lines);
  const std::size_t at_start = mesh.triangle_count();
  if (count == ~std::uint64_t(0))
    insertion.run_worst_first(count, progress);
  else  // An insertion adds two triangles, so the last one may be one too many for an odd count.
    insertion.run_to_low(count - (count > 2), insertions_back(count), progress);
  if (progress.stopped()) return fail(Errc::cancelled, "stopped");
  Simplified result;
  result.tin = mesh.to_tin();
  result.steps = insertion.insertions();
  result.input_triangles = full;
  if (count != ~std::uint64_t(0))
    result.note = count_note(result.tin.triangles.size(), count, at_start,
                             insertion.remaining_error() == 0, lines != nullptr);
  return result;
}

}  // namespace

Result<Simplified> simplify_greedy(const Terrain& dem, const GreedyOptions&, const RunOptions& o,
                                   const Progress& progress) {
  const HeightGrid& grid = dem.grid;
  Result<CoarseConstrained> coarse = start(grid, o);
  if (!coarse) return std::unexpected(coarse.error());
  HalfedgeMesh& mesh = coarse->mesh;
  GridSamples samples;
  samples.cols = grid.cols();
  samples.rows = grid.rows();
  samples.z = (o.constraints ? coarse->posts : grid).values().data();
  const double full = o.constraints ? double(o.constraints->mesh.triangles.size())
                                    : 2.0 * (grid.cols() - 1) * (grid.rows() - 1);
  return grow(mesh, samples, o.constraints ? &coarse->lines : nullptr,
              delaunay_x_scale(dem.spacing_x_m, dem.spacing_y_m), std::uint64_t(full), o, progress);
}

Result<Simplified> simplify_greedy_samples(const Tin& start, const ScatteredSamples& samples,
                                           double x_scale, std::uint64_t triangles,
                                           const RunOptions& o, const Progress& progress) {
  Result<HalfedgeMesh> mesh = HalfedgeMesh::from_tin(start);
  if (!mesh) return std::unexpected(mesh.error());
  return grow(*mesh, samples, nullptr, x_scale, triangles, o, progress);
}

}  // namespace tind
