// Blocks, seams and counts around BoundedMesher.
//
// The grid is cut into fixed blocks. Block borders are lines that both sides derive alike (a cone
// filter along the posts), blocks are meshed independently and in parallel inside locked borders,
// then sewn together, and a last pass thins what lies along the seams. Blocks depend on the grid's
// size alone, so the result is the same for any number of threads.

#include "terrain/simplify/bounded.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>

#include "terrain/base/parallel.h"
#include "terrain/simplify/bounded_count.h"
#include "terrain/simplify/bounded_mesher.h"
#include "terrain/simplify/coarse_constrained.h"

namespace tind {

namespace {

constexpr int kBlockPosts = 512;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Effort {
  bool search;
  double reach;
  int rounds;
  double surplus;  // for a count: see CountOptions
  int fit_rounds;
};

Effort effort_of(const std::string& name) {
  if (name == "fast") return {true, 0.1, 0, 1.5, 2};
  if (name == "best") return {true, 3, 7, 3.5, 6};
  return {true, 1, 1, 1.8, 3};
}

/// One run at one error: everything that the pieces need.
struct Run {
  const HeightGrid& grid;
  double eps;     // half width of the band
  double offset;  // of the band's centre from the posts
  double x_scale;
  double relief;
  Effort effort;
  int threads;
  const Progress& progress;
  std::vector<int> col_cuts, row_cuts;  // block borders, ends included
  const Constraints* constraints = nullptr;

  double height(int col, int row) const { return double(grid.at(col, row)) + offset; }
};

std::vector<int> cuts(int posts) {
  const int blocks = std::max(1, int(std::lround(double(posts) / kBlockPosts)));
  std::vector<int> at;
  for (int k = 0; k <= blocks; ++k) at.push_back(int(std::int64_t(posts - 1) * k / blocks));
  return at;
}

/// The height of a block corner: its post, or the nearest valid one where it is void.
double corner_height(const Run& run, int col, int row) {
  if (!run.grid.is_void(col, row)) return run.height(col, row);
  double best = kInfinity, height = run.offset;
  for (int reach = 1; reach < std::max(run.grid.cols(), run.grid.rows()) && best > reach;
       reach *= 2) {
    for (int r = std::max(0, row - reach); r <= std::min(run.grid.rows() - 1, row + reach); ++r) {
      for (int c = std::max(0, col - reach); c <= std::min(run.grid.cols() - 1, col + reach); ++c) {
        const double d = std::hypot(double(c - col), double(r - row));
        if (d < best && !run.grid.is_void(c, r)) best = d, height = run.height(c, r);
      }
    }
  }
  return height;
}

/// The posts between two block corners, thinned by a cone filter: inner vertices only.
std::vector<Vec3> seam_line(const Run& run, int col, int row, int dcol, int drow, int length) {
  const double tolerance = 0.7 * run.eps;
  std::vector<Vec3> line;
  int from = 0;
  double from_height = corner_height(run, col, row);
  const double end_height = corner_height(run, col + dcol * length, row + drow * length);
  for (;;) {
    double lo = -kInfinity, hi = kInfinity, slope = 0;
    int reached = from;
    bool open = true;
    for (int i = from + 1; i < length && open; ++i) {
      const int c = col + dcol * i, r = row + drow * i;
      if (run.grid.is_void(c, r)) continue;
      const double h = run.height(c, r), n = i - from;
      const double l = std::max(lo, (h - tolerance - from_height) / n);
      const double u = std::min(hi, (h + tolerance - from_height) / n);
      open = l <= u;
      if (open) lo = l, hi = u, reached = i, slope = (l + u) / 2;
    }
    const double direct = (end_height - from_height) / (length - from);
    if (open && direct >= lo && direct <= hi) return line;
    if (reached == from) return line;
    from_height += slope * (reached - from);
    from = reached;
    line.push_back({double(col + dcol * from), -double(row + drow * from), from_height});
  }
}

/// All seam lines by where they start, so that both blocks at a seam take the same one.
struct Seams {
  std::vector<std::vector<Vec3>> east, south;  // of block corner (i, j): j * corners + i
};

Seams derive_seams(const Run& run) {
  const std::size_t cols = run.col_cuts.size(), rows = run.row_cuts.size();
  Seams seams;
  seams.east.resize(cols * rows);
  seams.south.resize(cols * rows);
  parallel_for(cols * rows, run.threads, [&](std::size_t k) {
    const std::size_t i = k % cols, j = k / cols;
    const int c = run.col_cuts[i], r = run.row_cuts[j];
    if (i + 1 < cols) seams.east[k] = seam_line(run, c, r, 1, 0, run.col_cuts[i + 1] - c);
    if (j + 1 < rows) seams.south[k] = seam_line(run, c, r, 0, 1, run.row_cuts[j + 1] - r);
  });
  return seams;
}

BoundedOptions mesher_options(const Run& run) {
  BoundedOptions o;
  o.eps = run.eps;
  o.relief = run.relief;
  o.x_scale = run.x_scale;
  o.search = run.effort.search;
  o.search_reach = run.effort.reach;
  o.rounds = run.effort.rounds;
  o.search_step_min = 0.125;  // posts: a vertex need not be a post
  return o;
}

GridSamples samples_of(const Run& run, int col, int row, int cols, int rows) {
  GridSamples s;
  s.cols = cols, s.rows = rows;
  s.x0 = col, s.y0 = -row;
  s.z = run.grid.row(row).data() + col;
  s.stride = std::size_t(run.grid.cols());
  s.offset = run.offset;
  return s;
}

/// The rectangle between two columns and two rows, as two triangles.
Tin two_triangles(const Run& run, int c0, int c1, int r0, int r1) {
  Tin corners;
  for (const auto& [c, r] : {std::pair{c0, r1}, {c1, r1}, {c1, r0}, {c0, r0}})
    corners.vertices.push_back({double(c), -double(r), corner_height(run, c, r)});
  corners.triangles = {{0, 1, 2}, {0, 2, 3}};
  return corners;
}

Tin mesh_block(const Run& run, const Seams& seams, std::size_t i, std::size_t j) {
  const int c0 = run.col_cuts[i], c1 = run.col_cuts[i + 1];
  const int r0 = run.row_cuts[j], r1 = run.row_cuts[j + 1];
  const Tin corners = two_triangles(run, c0, c1, r0, r1);
  HalfedgeMesh mesh = *HalfedgeMesh::from_tin(corners);
  const GridSamples samples = samples_of(run, c0, r0, c1 - c0 + 1, r1 - r0 + 1);
  {
    InsertionOptions o;
    o.x_scale = run.x_scale;
    DelaunayInsertion<GridSamples> frame(mesh, samples, o);
    const std::size_t k = j * run.col_cuts.size() + i;
    for (const auto* line : {&seams.east[k], &seams.east[k + run.col_cuts.size()], &seams.south[k],
                             &seams.south[k + 1]})
      for (const Vec3& p : *line) frame.insert_point(p);
  }
  BoundedOptions o = mesher_options(run);
  o.locked_border = true;
  BoundedMesher<GridSamples> mesher(std::move(mesh), samples, o);
  Progress quiet;
  quiet.stop = run.progress.stop;
  mesher.run(quiet);
  return mesher.mesh().to_tin();
}

/// One mesh of all blocks: vertices on block borders are shared. `seam` marks those.
Tin sew(const Run& run, const std::vector<Tin>& blocks, std::vector<std::uint8_t>& seam) {
  auto on_cut = [](const std::vector<int>& at, double t) {
    return t == std::floor(t) && std::binary_search(at.begin(), at.end(), int(t));
  };
  Tin all;
  std::map<std::pair<double, double>, std::uint32_t> shared;
  std::vector<std::uint32_t> index;
  for (const Tin& block : blocks) {
    index.clear();
    for (const Vec3& p : block.vertices) {
      const bool on_seam = on_cut(run.col_cuts, p.x) || on_cut(run.row_cuts, -p.y);
      if (on_seam) {
        const auto [there, is_new] =
            shared.try_emplace({p.x, p.y}, std::uint32_t(all.vertices.size()));
        index.push_back(there->second);
        if (!is_new) continue;
      } else {
        index.push_back(std::uint32_t(all.vertices.size()));
      }
      all.vertices.push_back(p);
      seam.push_back(on_seam);
    }
    for (const Triangle& t : block.triangles)
      all.triangles.push_back({index[t[0]], index[t[1]], index[t[2]]});
  }
  return all;
}

/// Spreads marks to neighbours, `rings` times.
void widen(std::vector<std::uint8_t>& marks, const Tin& tin, int rings) {
  for (int k = 0; k < rings; ++k) {
    std::vector<std::uint8_t> wider = marks;
    for (const Triangle& t : tin.triangles)
      if (marks[t[0]] | marks[t[1]] | marks[t[2]]) wider[t[0]] = wider[t[1]] = wider[t[2]] = 1;
    marks.swap(wider);
  }
}

/// Lines know no blocks: one mesh, on one thread, grown around them and thinned between them.
Result<Simplified> run_with_lines(const Run& run, const Constraints& constraints) {
  auto coarse = coarse_constrained(constraints);
  if (!coarse) return std::unexpected(coarse.error());
  GridSamples samples;
  samples.cols = coarse->posts.cols(), samples.rows = coarse->posts.rows();
  samples.z = coarse->posts.values().data();
  const auto at_start = double(coarse->mesh.triangle_count());
  BoundedMesher<GridSamples> mesher(std::move(coarse->mesh), samples, mesher_options(run));
  mesher.keep(&coarse->lines);
  mesher.run(run.progress);
  if (run.progress.stopped()) return fail(Errc::cancelled, "stopped");
  Simplified result;
  result.tin = mesher.mesh().to_tin();
  result.input_triangles = constraints.mesh.triangles.size();
  result.steps = mesher.stats().swept + mesher.stats().searched;
  result.details["half_band_m"] = run.eps;
  result.details["triangles_of_lines_alone"] = at_start;
  return result;
}

Result<Simplified> run_once(const Run& run) {
  if (run.constraints) return run_with_lines(run, *run.constraints);
  const Seams seams = derive_seams(run);
  const std::size_t across = run.col_cuts.size() - 1, blocks = across * (run.row_cuts.size() - 1);
  std::vector<Tin> meshes(blocks);
  std::atomic<std::size_t> done = 0;
  parallel_for(blocks, run.threads, [&](std::size_t k) {
    if (run.progress.stopped()) return;
    meshes[k] = mesh_block(run, seams, k % across, k / across);
    run.progress.at(0.9 * double(++done) / double(blocks));
  });
  if (run.progress.stopped()) return fail(Errc::cancelled, "stopped");
  std::vector<std::uint8_t> seam;
  Tin all = sew(run, meshes, seam);
  meshes.clear();
  widen(seam, all, 2);
  auto mesh = HalfedgeMesh::from_tin(all);
  if (!mesh) return fail("sewing blocks", mesh.error());
  const GridSamples samples = samples_of(run, 0, 0, run.grid.cols(), run.grid.rows());
  BoundedMesher<GridSamples> mesher(std::move(*mesh), samples, mesher_options(run));
  Progress quiet;
  quiet.stop = run.progress.stop;
  mesher.mend(std::move(seam), quiet);
  Simplified result;
  result.tin = mesher.mesh().to_tin();
  result.input_triangles = std::uint64_t(2) * (run.grid.cols() - 1) * (run.grid.rows() - 1);
  result.steps = mesher.stats().swept + mesher.stats().searched;
  result.details["blocks"] = double(blocks);
  result.details["half_band_m"] = run.eps;
  return result;
}

double relief_of(const HeightGrid& grid) {
  float low = HUGE_VALF, high = -HUGE_VALF;
  for (const float z : grid.values())
    if (!std::isnan(z)) low = std::min(low, z), high = std::max(high, z);
  return double(high) - low;
}

Run make_run(const HeightGrid& grid, double max_error, double x_scale, const SimplifyOptions& o,
             const Progress& progress) {
  const bool both = o.side == "both";
  return Run{.grid = grid,
             .eps = both ? max_error : max_error / 2,
             .offset = both ? 0 : (o.side == "above" ? 0.5 : -0.5) * max_error,
             .x_scale = x_scale,
             .relief = relief_of(grid),
             .effort = effort_of(o.effort),
             .threads = o.threads,
             .progress = progress,
             .col_cuts = cuts(grid.cols()),
             .row_cuts = cuts(grid.rows()),
             .constraints = o.constraints.get()};
}

/// The smallest RMS error with at most `target` triangles.
Result<Simplified> fit_count(const Run& run, std::uint64_t target) {
  const int cols = run.grid.cols(), rows = run.grid.rows();
  Simplified result;
  result.input_triangles = std::uint64_t(2) * (cols - 1) * (rows - 1);
  CountOptions o;
  o.triangles = target;
  o.x_scale = run.x_scale;
  o.rounds = run.effort.fit_rounds;
  // Near the full mesh insertion is what takes long, and has little to gain.
  const double most = 0.75 * double(result.input_triangles) / double(target);
  o.surplus = std::clamp(most, 1.0, run.effort.surplus);
  auto fitted = fit_to_count(two_triangles(run, 0, cols - 1, 0, rows - 1),
                             samples_of(run, 0, 0, cols, rows), o, run.progress);
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
  double too_small = 1e-6, too_large = std::max(1.0, relief_of(grid) + 1);
  double error = std::max(too_small * 2, (too_large - 1) / 50);
  Result<Simplified> best = fail(Errc::internal, "no mesh");
  for (int i = 0; i < 16; ++i) {
    Progress part;
    part.stop = progress.stop;
    progress.at(i / 16.0);
    auto found = run_once(make_run(grid, error, x_scale, o, part));
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
  if (!best) return run_once(make_run(grid, too_large, x_scale, o, progress));
  return best;
}

}  // namespace

Result<Simplified> simplify_bounded(const HeightGrid& grid, double spacing_x_m, double spacing_y_m,
                                    const SimplifyOptions& o, const Progress& progress) {
  if (o.side != "both" && o.side != "above" && o.side != "below")
    return fail(Errc::invalid_argument, "--side is both, above or below");
  if (o.effort != "fast" && o.effort != "normal" && o.effort != "best")
    return fail(Errc::invalid_argument, "--effort is fast, normal or best");
  if (o.constraints && o.side != "both")
    return fail(Errc::invalid_argument,
                "lines have one height: with them --side is both, neither above nor below");
  if (std::ranges::all_of(grid.values(), [](float z) { return std::isnan(z); }))
    return fail(Errc::bad_data, "the grid holds no valid height at all");
  const double x_scale = delaunay_x_scale(spacing_x_m, spacing_y_m);
  if (o.stop.max_error_m) {
    if (!(*o.stop.max_error_m > 0))
      return fail(Errc::invalid_argument, "bounded needs a maximum error above 0");
    return run_once(make_run(grid, *o.stop.max_error_m, x_scale, o, progress));
  }
  const double full = o.constraints ? double(o.constraints->mesh.triangles.size())
                                    : 2.0 * (grid.cols() - 1) * (grid.rows() - 1);
  const double wanted = o.stop.triangles ? double(*o.stop.triangles) : *o.stop.ratio * full;
  const auto target = std::uint64_t(std::max(2.0, wanted));
  const bool fits = o.side == "both" && !o.constraints;
  auto result = fits ? fit_count(make_run(grid, 0, x_scale, o, progress), target)
                     : reach_count(grid, x_scale, target, o, progress);
  if (result && double(result->tin.triangles.size()) > std::max(2.0, wanted))
    result->note = "the lines need " + std::to_string(result->tin.triangles.size()) + " triangles";
  if (result && double(result->tin.triangles.size()) < 0.99 * std::floor(wanted))
    result->note = "no error is left that more triangles would take away";
  return result;
}

}  // namespace tind
