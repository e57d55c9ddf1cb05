// Options to runs: the band from the side, what an effort means, counts for one side by search.

#include "terrain/simplify/bounded.h"

#include <algorithm>
#include <cmath>

#include "terrain/simplify/bounded_blocks.h"
#include "terrain/simplify/bounded_count.h"
#include "terrain/simplify/coarse_constrained.h"

namespace tind {

namespace {

struct Effort {
  double reach;
  int rounds;
  int move_tries;
  double step_gain;
  double surplus;  // for a count: see CountOptions
  int fit_rounds;
};

Effort effort_of(const std::string& name) {
  if (name == "fast") return {0.1, 0, 0, 0, 1.5, 2};
  if (name == "best") return {3, 5, 12, 0, 3.5, 6};
  return {1, 1, 6, 0.1, 1.8, 3};
}

BlockOptions block_options(const SimplifyOptions& o, double max_error, double x_scale) {
  const Effort effort = effort_of(o.effort);
  const bool both = o.side == "both";
  BlockOptions b;
  b.mesher.eps = both ? max_error : max_error / 2;
  b.offset = both ? 0 : (o.side == "above" ? 0.5 : -0.5) * max_error;
  b.mesher.x_scale = x_scale;
  b.mesher.search_reach = effort.reach;
  b.mesher.rounds = effort.rounds;
  b.mesher.flips = effort.rounds > 1;
  b.mesher.move_tries = effort.move_tries;
  b.mesher.step_gain = effort.step_gain;
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
                                  const BoundedOptions& o, const Progress& progress) {
  auto coarse = coarse_constrained(constraints);
  if (!coarse) return std::unexpected(coarse.error());
  GridSamples samples;
  samples.cols = coarse->posts.cols(), samples.rows = coarse->posts.rows();
  samples.z = coarse->posts.values().data();
  const auto at_start = double(coarse->mesh.triangle_count());
  BoundedOptions mesher_options = o;
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
Result<Simplified> run_grid(const HeightGrid& grid, const SimplifyOptions& o, double max_error,
                            double x_scale, const Progress& progress) {
  const BlockOptions block = block_options(o, max_error, x_scale);
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

/// The smallest RMS error with at most `target` triangles.
Result<Simplified> fit_count(const HeightGrid& grid, double x_scale, const Effort& effort,
                             std::uint64_t target, const Progress& progress) {
  const auto start = two_triangles(grid);
  if (!start) return std::unexpected(start.error());
  GridSamples samples;
  samples.cols = grid.cols(), samples.rows = grid.rows();
  samples.z = grid.values().data();
  Simplified result;
  result.input_triangles = full_triangles(grid.cols(), grid.rows());
  CountOptions o;
  o.triangles = target;
  o.x_scale = x_scale;
  o.rounds = effort.fit_rounds;
  // Near the full mesh insertion is what takes long, and has little to gain.
  const double most = 0.75 * double(result.input_triangles) / double(target);
  o.surplus = std::clamp(most, 1.0, effort.surplus);
  auto fitted = fit_to_count(*start, samples, o, progress);
  if (!fitted) return std::unexpected(fitted.error());
  result.tin = std::move(fitted->tin);
  result.steps = fitted->collapses;
  result.details["max_error_allowed_m"] = fitted->max_error_m;
  return result;
}

/// The smallest error whose mesh has at most `target` triangles, to about one per cent: secant
/// steps on log(count) against log(error), inside a bracket.
Result<Simplified> reach_count(const HeightGrid& grid, double x_scale, std::uint64_t target,
                               const SimplifyOptions& o, const Progress& progress) {
  const double relief = relief_of(grid);
  // At twice the relief, half of the band holds all samples: two triangles.
  double too_small = 1e-6, too_large = 2 * relief + 1;
  double error = std::max(too_small * 2, relief / 50);
  Result<Simplified> best = fail(Errc::internal, "no mesh");
  for (int i = 0; i < 16; ++i) {
    Progress part;
    part.stop = progress.stop;
    progress.at(i / 16.0);
    auto found = run_grid(grid, o, error, x_scale, part);
    if (!found) return found;
    const double n = double(found->tin.triangles.size());
    const bool fits = n <= double(target);
    if (fits) {
      too_large = error;
      found->details["max_error_asked_m"] = error;
      best = std::move(found);
      if (n >= 0.99 * double(target)) break;
    } else {
      too_small = error;
    }
    if (too_large / too_small < 1.0005) break;
    // The count falls about as 1 / error.
    const double guess = error * n / (0.996 * double(target));
    error = guess > too_small * 1.0001 && guess < too_large * 0.9999
                ? guess
                : std::sqrt(too_small * too_large);
  }
  if (!best) return run_grid(grid, o, too_large, x_scale, progress);
  return best;
}

Result<void> check_options(const SimplifyOptions& o) {
  if (o.side != "both" && o.side != "above" && o.side != "below")
    return fail(Errc::invalid_argument, "--side is both, above or below");
  if (o.effort != "fast" && o.effort != "normal" && o.effort != "best")
    return fail(Errc::invalid_argument, "--effort is fast, normal or best");
  if (o.constraints && o.side != "both")
    return fail(Errc::invalid_argument,
                "lines have one height: with them --side is both, neither above nor below");
  if (o.stop.max_error_m && !(*o.stop.max_error_m > 0))
    return fail(Errc::invalid_argument, "bounded needs a maximum error above 0");
  return {};
}

}  // namespace

bool goes_by_rows(const SimplifyOptions& o) {
  return o.method == "bounded" && o.stop.max_error_m && !o.constraints && !o.recorder;
}

Result<Simplified> simplify_bounded_rows(const HeightRows& dem, double spacing_x_m,
                                         double spacing_y_m, const SimplifyOptions& o,
                                         const Progress& progress) {
  if (const auto ok = check_options(o); !ok) return std::unexpected(ok.error());
  if (!o.stop.max_error_m)
    return fail(Errc::invalid_argument, "only a maximum error can be met row by row");
  if (!(spacing_x_m > 0 && spacing_y_m > 0))
    return fail(Errc::invalid_argument, "the post spacing must be positive");
  if (dem.cols < 2 || dem.rows < 2)
    return fail(Errc::invalid_argument, "fewer than 2 x 2 posts have no triangles");
  const double x_scale = delaunay_x_scale(spacing_x_m, spacing_y_m);
  return run_once(dem, block_options(o, *o.stop.max_error_m, x_scale), progress);
}

Result<Simplified> simplify_bounded(const HeightGrid& grid, double spacing_x_m, double spacing_y_m,
                                    const SimplifyOptions& o, const Progress& progress) {
  if (const auto ok = check_options(o); !ok) return std::unexpected(ok.error());
  if (std::ranges::all_of(grid.values(), [](float z) { return std::isnan(z); }))
    return fail(Errc::bad_data, "the grid holds no valid height at all");
  const double x_scale = delaunay_x_scale(spacing_x_m, spacing_y_m);
  if (o.stop.max_error_m) return run_grid(grid, o, *o.stop.max_error_m, x_scale, progress);
  const double full = o.constraints ? double(o.constraints->mesh.triangles.size())
                                    : double(full_triangles(grid.cols(), grid.rows()));
  const double wanted = o.stop.triangles ? double(*o.stop.triangles) : *o.stop.ratio * full;
  const auto target = std::uint64_t(std::max(2.0, wanted));
  const bool fits = o.side == "both" && !o.constraints;
  auto result = fits ? fit_count(grid, x_scale, effort_of(o.effort), target, progress)
                     : reach_count(grid, x_scale, target, o, progress);
  if (!result) return result;
  const double left = double(result->tin.triangles.size());
  if (left > wanted) {
    result->note = (o.constraints ? "the lines need " : "the least are ") +
                   std::to_string(result->tin.triangles.size()) + " triangles";
  }
  if (left < 0.99 * std::floor(wanted))
    result->note = "no error is left that more triangles would take away";
  return result;
}

}  // namespace tind
