// Options to runs: the band from the side, what an effort means, counts for one side by search.

#include "terrain/simplify/bounded/bounded.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/bounded/bounded_blocks.h"
#include "terrain/simplify/bounded/bounded_count.h"
#include "terrain/simplify/bounded/search_effort.h"
#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/simplify/insertion/coarse_constrained.h"

namespace tind {

namespace {

/// What an effort means where a count is asked for: see CountOptions.
struct CountEffort {
  double surplus;
  int rounds;
};

CountEffort count_effort(Effort effort) {
  if (effort == Effort::fast) return {1.5, 2};
  if (effort == Effort::best) return {3.5, 6};
  return {1.8, 3};
}

BlockOptions block_options(const BoundedOptions& method, const RunOptions& o, double max_error,
                           double x_scale) {
  const bool both = method.side == Side::both;
  BlockOptions b;
  b.mesher.eps = both ? max_error : max_error / 2;
  b.offset = both ? 0 : (method.side == Side::above ? 0.5 : -0.5) * max_error;
  b.mesher.x_scale = x_scale;
  set_effort(mesh_effort(method.effort), b.mesher);
  b.mesher.search_step_min = 0.125;  // posts: a vertex need not be a post
  b.threads = o.threads;
  return b;
}

std::uint64_t full_triangles(int cols, int rows) {
  return std::uint64_t(2) * std::uint64_t(cols - 1) * std::uint64_t(rows - 1);
}

Result<Simplified> run_once(const HeightRows& dem, const BlockOptions& o,
                            const Progress& progress) {
  auto meshed = mesh_in_blocks(dem, o, progress);
  if (!meshed) return std::unexpected(meshed.error());
  Simplified result;
  result.tin = std::move(meshed->tin);
  result.input_triangles = full_triangles(dem.cols, dem.rows);
  result.steps = meshed->steps;
  result.details["blocks"] = double(meshed->blocks);
  result.details["half_band_m"] = o.mesher.eps;
  return result;
}

double relief_of(const HeightGrid& grid) {
  float low = HUGE_VALF, high = -HUGE_VALF;
  for (const float z : grid.values())
    if (!std::isnan(z)) low = std::min(low, z), high = std::max(high, z);
  return high >= low ? double(high) - low : 0;
}

/// Lines know no blocks: one mesh, on one thread, grown around them and thinned between them.
Result<Simplified> run_with_lines(const HeightGrid& grid, const Constraints& constraints,
                                  const MesherOptions& o, const Progress& progress) {
  auto coarse = coarse_constrained(constraints);
  if (!coarse) return std::unexpected(coarse.error());
  GridSamples samples;
  samples.cols = coarse->posts.cols(), samples.rows = coarse->posts.rows();
  samples.z = coarse->posts.values().data();
  const auto at_start = double(coarse->mesh.triangle_count());
  MesherOptions mesher_options = o;
  mesher_options.relief = relief_of(grid);
  BoundedMesher<GridSamples> mesher(std::move(coarse->mesh), samples, mesher_options);
  mesher.keep(&coarse->lines);
  mesher.run(progress);
  if (progress.stopped()) return fail(Errc::cancelled, "stopped");
  Simplified result;
  result.tin = mesher.mesh().to_tin();
  result.input_triangles = constraints.mesh.triangles.size();
  result.steps = mesher.stats().swept + mesher.stats().searched;
  result.details["half_band_m"] = o.eps;
  result.details["triangles_of_lines_alone"] = at_start;
  return result;
}

/// Within one error, with lines or without.
Result<Simplified> run_grid(const HeightGrid& grid, const BoundedOptions& method,
                            const RunOptions& o, double max_error, double x_scale,
                            const Progress& progress) {
  const BlockOptions block = block_options(method, o, max_error, x_scale);
  if (o.constraints) return run_with_lines(grid, *o.constraints, block.mesher, progress);
  return run_once(rows_of(grid), block, progress);
}

/// The rectangle as two triangles; void corners take any valid height.
Result<Tin> two_triangles(const HeightGrid& grid) {
  const auto first = std::ranges::find_if(grid.values(), [](float z) { return !std::isnan(z); });
  if (first == grid.values().end())
    return fail(Errc::bad_data, "the grid holds no valid height at all");
  const int c = grid.cols() - 1, r = grid.rows() - 1;
  Tin tin;
  for (const auto& [col, row] : {std::pair{0, r}, {c, r}, {c, 0}, {0, 0}}) {
    const float z = grid.is_void(col, row) ? *first : grid.at(col, row);
    tin.vertices.push_back({double(col), -double(row), double(z)});
  }
  tin.triangles = {{0, 1, 2}, {0, 2, 3}};
  return tin;
}

/// The smallest RMS error with at most `target` of `full` triangles.
template <class Samples>
Result<Simplified> fit_count(const Tin& start, const Samples& samples, std::uint64_t full,
                             double x_scale, const CountEffort& effort, std::uint64_t target,
                             const Progress& progress) {
  Simplified result;
  result.input_triangles = full;
  CountOptions o;
  o.triangles = target;
  o.x_scale = x_scale;
  o.any_place = std::is_same_v<Samples, ScatteredSamples>;
  o.rounds = effort.rounds;
  // Near the full mesh insertion is what takes long, and has little to gain.
  const double most = 0.75 * double(result.input_triangles) / double(target);
  o.surplus = std::clamp(most, 1.0, effort.surplus);
  auto fitted = fit_to_count(start, samples, o, progress);
  if (!fitted) return std::unexpected(fitted.error());
  result.tin = std::move(fitted->tin);
  result.steps = fitted->collapses;
  result.details["max_error_allowed_m"] = fitted->max_error_m;
  return result;
}

Result<Simplified> fit_grid(const HeightGrid& grid, double x_scale, const CountEffort& effort,
                            std::uint64_t target, const Progress& progress) {
  const auto start = two_triangles(grid);
  if (!start) return std::unexpected(start.error());
  GridSamples samples;
  samples.cols = grid.cols(), samples.rows = grid.rows();
  samples.z = grid.values().data();
  return fit_count(*start, samples, full_triangles(grid.cols(), grid.rows()), x_scale, effort,
                   target, progress);
}

/// The smallest error whose mesh has at most `target` triangles, to about one per cent. Between two
/// errors the count goes about as a power of the error, so its logarithm is taken as a straight
/// line; every second step that stays on one side of the target halves the bracket instead. Counts
/// jump a little: the largest that is not above the target is kept.
Result<Simplified> reach_count(const HeightGrid& grid, double x_scale, std::uint64_t target,
                               const BoundedOptions& method, const RunOptions& o,
                               const Progress& progress) {
  struct End {
    double error, count;
  };
  const double relief = relief_of(grid), aim = 0.996 * double(target);
  // At twice the relief, half of the band holds all samples: two triangles.
  End few{2 * relief + 1, 2};
  End many{1e-6, 2 * double(full_triangles(grid.cols(), grid.rows()))};
  double error = std::max(many.error * 2, relief / 50);
  Result<Simplified> best = fail(Errc::internal, "no mesh");
  int one_sided = 0;  // steps since the other end of the bracket moved, signed
  for (int i = 0; i < 16; ++i) {
    Progress part;
    part.stop = progress.stop;
    progress.at(i / 16.0);
    auto found = run_grid(grid, method, o, error, x_scale, part);
    if (!found) return found;
    const double n = double(found->tin.triangles.size());
    const bool fits = n <= double(target);
    (fits ? few : many) = {error, n};
    one_sided = fits ? std::max(one_sided, 0) + 1 : std::min(one_sided, 0) - 1;
    if (fits && (!best || n > double(best->tin.triangles.size()))) {
      found->details["max_error_asked_m"] = error;
      best = std::move(found);
      if (n >= 0.99 * double(target)) break;
    }
    if (few.error / many.error < 1.0005) break;
    const double power = std::log(many.count / few.count) / std::log(many.error / few.error);
    const double guess = many.error * std::pow(aim / many.count, 1 / power);
    error = std::abs(one_sided) < 2 && guess > many.error * 1.0001 && guess < few.error * 0.9999
                ? guess
                : std::sqrt(few.error * many.error);
    if (std::abs(one_sided) >= 2) one_sided = 0;
  }
  if (!best) return run_grid(grid, method, o, few.error, x_scale, progress);
  return best;
}

Result<void> check_options(const BoundedOptions& method, const RunOptions& o) {
  if (o.constraints && method.side != Side::both)
    return fail(Errc::invalid_argument,
                "lines have one height: with them --side is both, neither above nor below");
  if (o.stop.max_error_m && !(*o.stop.max_error_m > 0))
    return fail(
        Errc::invalid_argument,
        "bounded needs a maximum error above 0; qem, memoryless and greedy (--method) take 0");
  return {};
}

/// Why a mesh has more triangles than wanted, or far fewer.
std::string count_note(const Simplified& made, const HeightGrid& grid, const RunOptions& o,
                       std::uint64_t wanted) {
  const std::size_t left = made.tin.triangles.size();
  if (left > wanted) {
    return o.constraints ? edges_alone_note(left)
                         : "the least are " + std::to_string(left) + " triangles";
  }
  if (double(left) >= 0.99 * double(wanted)) return {};
  const HeightGrid& posts = o.constraints ? o.constraints->dem.grid : grid;
  if (vertical_error(made.tin, posts, o.threads).max_m < 1e-5)
    return "no error is left that more triangles would take away";
  return std::to_string(left) + " triangles, not " + std::to_string(wanted) +
         ": the nearest count from below that the search over the error has met";
}

}  // namespace

bool goes_by_rows(const RunOptions& o) {
  return o.stop.max_error_m && !o.constraints && !o.recorder;
}

Result<Simplified> simplify_bounded_rows(const HeightRows& dem, double spacing_x_m,
                                         double spacing_y_m, const BoundedOptions& method,
                                         const RunOptions& o, const Progress& progress) {
  if (const auto ok = check_options(method, o); !ok) return std::unexpected(ok.error());
  if (!o.stop.max_error_m)
    return fail(Errc::invalid_argument, "only a maximum error can be met row by row");
  if (!(spacing_x_m > 0 && spacing_y_m > 0))
    return fail(Errc::invalid_argument, "the post spacing must be positive");
  if (dem.cols < 2 || dem.rows < 2)
    return fail(Errc::invalid_argument, "fewer than 2 x 2 posts have no triangles");
  const double x_scale = delaunay_x_scale(spacing_x_m, spacing_y_m);
  return run_once(dem, block_options(method, o, *o.stop.max_error_m, x_scale), progress);
}

Result<Simplified> simplify_bounded(const Terrain& dem, const BoundedOptions& method,
                                    const RunOptions& o, const Progress& progress) {
  const HeightGrid& grid = dem.grid;
  if (const auto ok = check_options(method, o); !ok) return std::unexpected(ok.error());
  if (std::ranges::all_of(grid.values(), [](float z) { return std::isnan(z); }))
    return fail(Errc::bad_data, "the grid holds no valid height at all");
  const double x_scale = delaunay_x_scale(dem.spacing_x_m, dem.spacing_y_m);
  if (o.stop.max_error_m) return run_grid(grid, method, o, *o.stop.max_error_m, x_scale, progress);
  const std::uint64_t full = o.constraints ? o.constraints->mesh.triangles.size()
                                           : full_triangles(grid.cols(), grid.rows());
  const std::uint64_t wanted = target_triangles(o.stop, full);
  const std::uint64_t target = std::max<std::uint64_t>(2, wanted);
  const bool fits = method.side == Side::both && !o.constraints;
  auto result = fits ? fit_grid(grid, x_scale, count_effort(method.effort), target, progress)
                     : reach_count(grid, x_scale, target, method, o, progress);
  if (!result) return result;
  result->note = count_note(*result, grid, o, wanted);
  return result;
}

Result<Simplified> simplify_bounded_samples(const Tin& start, ScatteredSamples samples,
                                            double x_scale, std::uint64_t triangles,
                                            const BoundedOptions& method, const RunOptions& o,
                                            const Progress& progress) {
  if (const auto ok = check_options(method, o); !ok) return std::unexpected(ok.error());
  if (!o.stop.max_error_m) {
    if (method.side != Side::both)
      return fail(Errc::unsupported,
                  "of a TIN, --side above and below need --max-error, not a count");
    const std::uint64_t wanted = target_triangles(o.stop, triangles);
    const std::uint64_t target = std::max<std::uint64_t>(2, wanted);
    auto made = fit_count(start, samples, triangles, x_scale, count_effort(method.effort), target,
                          progress);
    if (made && made->tin.triangles.size() > wanted)
      made->note = "the outline needs " + std::to_string(made->tin.triangles.size()) + " triangles";
    return made;
  }
  const BlockOptions block = block_options(method, o, *o.stop.max_error_m, x_scale);
  samples.offset = block.offset;
  MesherOptions options = block.mesher;
  options.any_place = true;
  options.pinned = std::uint32_t(start.vertices.size());  // of the outline all that stay
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (std::size_t i = 0; i < samples.size(); ++i)
    low = std::min(low, samples.sample(i).z), high = std::max(high, samples.sample(i).z);
  options.relief = std::max(0.0, high - low);
  auto mesh = HalfedgeMesh::from_tin(start);
  if (!mesh) return std::unexpected(mesh.error());
  BoundedMesher<ScatteredSamples> mesher(std::move(*mesh), samples, options);
  mesher.run(progress);
  if (progress.stopped()) return fail(Errc::cancelled, "stopped");
  Simplified result;
  result.tin = mesher.mesh().to_tin();
  result.input_triangles = triangles;
  result.steps = mesher.stats().swept + mesher.stats().searched;
  return result;
}

}  // namespace tind
