// From a tile's borders and posts to its mesh: fitted in the tile's integer grid, measured over
// every post (or, on the coarse levels of large sources, against the residual lattice), and kept on
// one side where that is asked for.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "terrain/base/power_of_two.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/mesh/triangle_plane.h"
#include "terrain/pyramid/make/tile_colours.h"
#include "terrain/pyramid/make/tile_frame.h"
#include "terrain/pyramid/make/tile_job.h"
#include "terrain/pyramid/make/tile_methods.h"
#include "terrain/pyramid/residual/residual_index.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/simplify/bounded/bounded_mesher.h"
#include "terrain/simplify/bounded/search_effort.h"
#include "terrain/surface/post_warp.h"

namespace tind {

namespace {

constexpr double kPlacingError = 1e-5;     // metres of height: kPlacing_m on a slope of ten
constexpr double kPlacing_m = 1e-6;        // how well posts are placed by interpolation
constexpr double kPlacingDegrees = 1e-14;  // and by arithmetic alone
constexpr double kLeastStated = 1e-7;      // metres: less is no digit that is stated
constexpr double kLargestHeightStep = 4;   // metres
constexpr double kLinePlaceStep = 2;       // units: half of what shores keep from posts at least
constexpr double kNarrower = 0.7;          // of the band, for a method or lines that left it
constexpr int kFirstNodes = 128;           // a side of a lattice, that a mesh is fitted to first
constexpr double kFirstShare = 0.9;        // of the band, for a mesh that will be refined
constexpr double kOnlyShare = 0.7;         // for one that will not
constexpr double kAround = 1.6;            // posts, beside one that no mesh comes near
constexpr double kMetresPerDegree = 111320;
constexpr int kMostPasses = 4;            // that bring single cells of a lattice into the budget
constexpr std::int64_t kMeshPosts = 320;  // posts a side that a mesh is fitted to at most

/// How far the mesh rises above a post and falls below one, at most; negative: it never does.
struct Extremes {
  double above = -HUGE_VAL, below = -HUGE_VAL;
  double error() const { return std::max({above, below, 0.0}); }
  /// How far the mesh is on the wrong side of some post that is only known within `margin`.
  double wrong(Side side, double margin) const {
    if (side == Side::both) return 0;
    return std::max(0.0, (side == Side::above ? below : above) + margin);
  }
};

bool placed_by_interpolation(const TileJob& job) {
  const Surface& surface = job.surface;
  return !(job.alone() ? surface.layers()[job.windows[0].layer].source->is_plain_geographic()
                       : surface.is_plain_geographic());
}

/// Stored heights are floats, and posts of projected sources are placed by interpolation (within
/// 1e-6 m): both count as error.
double margin_of(const TileJob& job) {
  return job.surface.info().rounding_m + (placed_by_interpolation(job) ? kPlacingError : 0);
}

/// The length of a unit eastward over that of one northward.
double x_scale(const TileJob& job) {
  const double lat = (job.rect.south + job.rect.north) / 2 * std::numbers::pi / 180;
  return std::max(0.1, std::cos(lat));
}

/// What a post's place not being known better counts on a slope that no terrain has, but a sliver,
/// or a DEM whose voids are heights: what is less is in the margin, or no digit that is stated.
class SteepPlacing {
 public:
  explicit SteepPlacing(const TileJob& job) {
    const double unit_m =
        job.rect.height() * kMetresPerDegree / kTileExtent * std::min(1.0, x_scale(job));
    const bool interpolated = placed_by_interpolation(job);
    placed_ = interpolated ? kPlacing_m / unit_m : kPlacingDegrees / job.rect.width() * kTileExtent;
    least_ = interpolated ? kPlacingError : kLeastStated;
  }
  double error(const Vec2& slope) const {
    const double error = placed_ * std::hypot(slope.x, slope.y);
    return error > least_ ? error : 0;
  }

 private:
  double placed_, least_;  // tile units, metres
};

/// Calls f(triangle, x, y, mesh - post) for every valid post of the closed rectangle.
template <class F>
Result<void> each_residual(const TileJob& job, const Tin& mesh, std::stop_token stop, F&& f) {
  return stream_posts(job, stop, [&](const TilePosts& posts) {
    posts.visit([&](const auto& samples) {
      for (const Triangle& t : mesh.triangles) {
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        const TrianglePlane plane(a, b, c);
        samples.scan(a, b, c, [&](double x, double y, double z, std::size_t) {
          f(t, x, y, plane.at(x, y) - (z - job.level.offset_m));
          return true;
        });
      }
    });
  });
}

/// The referee. Asks for posts only that are farther out than the worst before, so nearly all cost
/// next to nothing.
Result<Extremes> measure(const TileJob& job, const Tin& mesh, std::stop_token stop) {
  constexpr double kRounding = 1e-9;  // of the band: what is left out is inside for certain
  const double offset = job.level.offset_m;
  const SteepPlacing placing(job);
  Extremes worst;
  auto done = stream_posts(job, stop, [&](const TilePosts& posts) {
    posts.visit([&](const auto& samples) {
      for (const Triangle& t : mesh.triangles) {
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        const TrianglePlane plane(a, b, c);
        const double steep = placing.error(plane.slope);
        Band band{a.x, a.y, a.z + offset};
        band.top_x = band.bottom_x = plane.slope.x, band.top_y = band.bottom_y = plane.slope.y;
        const auto set_band = [&] {
          band.size = std::max(std::abs(b.z - a.z), std::abs(c.z - a.z)) +
                      std::max(std::abs(worst.above), std::abs(worst.below));
          const double hair = kRounding * (band.size + std::abs(band.z)) + steep;
          band.top = worst.below - hair, band.bottom = hair - worst.above;
        };
        set_band();
        samples.scan_outside(a, b, c, band, [&](double x, double y, double z, std::size_t) {
          const double over = plane.at(x, y) - (z - offset);
          worst.above = std::max(worst.above, over + steep);
          worst.below = std::max(worst.below, steep - over);
          set_band();
          return true;
        });
      }
    });
  });
  if (!done) return std::unexpected(done.error());
  return worst;
}

/// Of a mesh with vertices on a lattice of heights, within `eps` of the samples.
MesherOptions mesher_options(const TileJob& job, const HeightLattice& lattice, double eps,
                             double place_step) {
  MesherOptions o;
  o.eps = eps;
  if (job.posts.any()) o.relief = job.posts.max_m - job.posts.min_m;
  o.x_scale = x_scale(job);
  o.locked_border = o.integer_lattice = true;
  o.lattice_max = kTileExtent;
  o.height_step =
      std::max(lattice.step, std::min(kLargestHeightStep, power_of_two_at_most(eps / 8)));
  // A vertex that is moved to a coarser lattice must not end up in the water beside its post.
  o.lattice_step = o.search_step_min =
      job.lines.lines.empty() ? place_step : std::min(place_step, kLinePlaceStep);
  o.turns = !job.lines.lines.empty();
  if (job.surrounds)
    o.surround = kAround * job.spacing_m() * kTileExtent /
                 (tiling::tile_degrees(job.id.level) * kMetresPerDegree) /
                 std::min(1.0, x_scale(job));
  o.height_min = lattice.min;
  o.height_max = lattice.max();
  set_effort(tile_effort(job.plan.options().effort), o);
  return o;
}

/// Fits a mesh within `eps` of the samples. Its error is not known yet.
template <class Samples>
TileMesh mesh_within(TileJob& job, const Samples& samples, double eps, double place_step,
                     std::stop_token stop) {
  const Stopwatch watch(job.cost.fitting);
  TileMesh result;
  // A band by the index may be wider than any heights that tiles have numbers for.
  result.lattice = height_lattice(job, std::min(eps, job.level.fit_error_m));
  MesherOptions o = mesher_options(job, result.lattice, eps, place_step);
  Progress progress;
  progress.stop = stop;
  LinePoints kept;
  HalfedgeMesh frame = frame_mesh(job, samples, o.x_scale, result.lattice, kept);
  o.pinned = result.pinned = std::uint32_t(frame.vertex_slots());
  if (!std::holds_alternative<BoundedOptions>(job.method)) {
    const double mid = (job.rect.south + job.rect.north) / 2;
    const double metres = job.rect.height() * wgs84::metres_per_degree(mid).y / kTileExtent;
    result.mesh = mesh_by_method(job.method, std::move(frame),
                                 job.stand_in.empty() && job.lines.lines.empty() ? nullptr : &kept,
                                 samples, o, metres, progress, job.colours);
    return result;
  }
  BoundedMesher mesher(std::move(frame), samples, o);
  if (!job.stand_in.empty() || !job.lines.lines.empty()) mesher.keep(&kept);
  mesher.run(progress);
  result.mesh = mesher.mesh().to_tin();
  return result;
}

/// Of which meshes may more samples be asked for? Lines are known to the mesher that has put them
/// in.
bool may_be_refined(const TileJob& job) {
  return std::holds_alternative<BoundedOptions>(job.method) && job.stand_in.empty() &&
         job.lines.lines.empty();
}

/// Brings a mesh that was fitted to some of the samples within `eps` of all.
template <class Samples>
void refine(TileJob& job, const Samples& samples, double eps, double place_step,
            std::stop_token stop, TileMesh& mesh) {
  const Stopwatch watch(job.cost.fitting);
  MesherOptions o = mesher_options(job, mesh.lattice, eps, place_step);
  o.pinned = mesh.pinned;
  Progress progress;
  progress.stop = stop;
  BoundedMesher mesher(*HalfedgeMesh::from_tin(mesh.mesh), samples, o);
  mesher.refine(progress);
  mesh.mesh = mesher.mesh().to_tin();
}

/// Of the layer that is skipped most every `step`-th post; of the others as many times fewer as of
/// that. REQUIRES: a power of two.
int step_of(const TileJob& job, const LayerWindow& w, int step) {
  return std::max(1, decimation(job, w) * step / decimation(job));
}

/// What the referee says of a mesh, over all posts.
Result<void> judge(TileJob& job, TileMesh& mesh, std::stop_token stop) {
  const Stopwatch watch(job.cost.measuring);
  if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
  const auto measured = measure(job, mesh.mesh, stop);
  if (!measured) return std::unexpected(measured.error());
  const double margin = margin_of(job);
  mesh.max_error = measured->error() + (job.posts.any() ? margin : 0);
  mesh.wrong_side = measured->wrong(job.plan.options().side, margin);
  return {};
}

/// How a mesh is to be refined.
struct Refinement {
  double eps = 0, place_step = 1;
};

/// Fits a mesh within `eps` of every `step`-th post, refines it where that is asked for to all of
/// them, then measures it over all.
Result<TileMesh> fit(TileJob& job, double eps, int step, double place_step,
                     const std::optional<Refinement>& finer, std::stop_token stop) {
  std::optional<TilePosts> decimated;
  if (step > 1 || !job.whole) {
    std::vector<LayerWindow> windows = job.windows;
    for (LayerWindow& w : windows) w.step = step_of(job, w, step);
    auto read = TilePosts::read(job.field, windows, job.id, job.level.offset_m, job.beside);
    if (!read) return std::unexpected(read.error());
    decimated.emplace(std::move(*read));
  }
  const TilePosts* given = decimated ? &*decimated : &*job.whole;
  std::optional<TilePosts> adapted;  // dry posts that a thinned shore takes for water
  if (!job.lines.between.empty()) {
    adapted.emplace(
        given->adapted([&](double u, double v, double z) { return level_by_lines(job, u, v, z); }));
    given = &*adapted;
  }
  const TilePosts& posts = *given;
  TileMesh result = posts.visit(
      [&](const auto& samples) { return mesh_within(job, samples, eps, place_step, stop); });
  if (finer)
    job.whole->visit([&](const auto& samples) {
      refine(job, samples, finer->eps, finer->place_step, stop, result);
    });
  if (auto done = judge(job, result, stop); !done) return std::unexpected(done.error());
  return result;
}

/// Moves inner vertices until no post is on the wrong side of the mesh: where the integer grid is
/// too coarse for the posts, the error may grow, but the side is kept. Posts between border
/// vertices only cannot be helped.
Result<void> force_side(const TileJob& job, TileMesh& m, std::stop_token stop) {
  constexpr double kLeastWeight = 0.05;
  const double margin = margin_of(job);
  const double up = job.plan.options().side == Side::above ? 1 : -1;
  const auto inner = [](const Vec3& v) {
    return v.x > 0 && v.y > 0 && v.x < kTileExtent && v.y < kTileExtent;
  };
  for (int pass = 0; pass < 4 && m.wrong_side > 0; ++pass) {
    std::vector<double> lift(m.mesh.vertices.size(), 0);
    auto seen =
        each_residual(job, m.mesh, stop, [&](const Triangle& t, double x, double y, double over) {
          const double missing = margin - up * over;
          if (missing <= 0) return;
          const Vec3 p{x, y, 0};
          double weight = 0, area = 0;
          for (int k = 0; k < 3; ++k) {
            const Vec3 &a = m.mesh.vertices[t[k]], &b = m.mesh.vertices[t[(k + 1) % 3]],
                       &c = m.mesh.vertices[t[(k + 2) % 3]];
            area = orient2d(a, b, c);
            if (inner(a)) weight += orient2d(p, b, c) / area;
          }
          if (weight < kLeastWeight) return;
          for (const auto v : t)
            if (inner(m.mesh.vertices[v])) lift[v] = std::max(lift[v], missing / weight);
        });
    if (!seen) return seen;
    for (std::size_t v = 0; v < lift.size(); ++v) {
      if (lift[v] == 0) continue;
      double& z = m.mesh.vertices[v].z;
      const double steps = std::ceil(lift[v] / m.lattice.step);
      z = std::clamp(z + up * steps * m.lattice.step, m.lattice.min, m.lattice.max());
    }
    const auto measured = measure(job, m.mesh, stop);
    if (!measured) return std::unexpected(measured.error());
    m.max_error = measured->error() + margin;
    m.wrong_side = measured->wrong(job.plan.options().side, margin);
  }
  return {};
}

/// Is it within the budget, and on its side?
bool is_good(const TileJob& job, const TileMesh& mesh) {
  return mesh.max_error <= job.level.budget_m && mesh.wrong_side == 0;
}

/// How bad: what the side lacks first, then the error.
std::pair<double, double> badness(const TileMesh& m) { return {m.wrong_side, m.max_error}; }

/// Is there memory, and some seconds, for every `step`-th post?
bool may_see_all(const TileJob& job, int step) {
  constexpr std::int64_t kMostSamples = std::int64_t(1) << 23;
  return std::ranges::all_of(job.windows, [step](const LayerWindow& w) {
    return std::int64_t(w.posts.cols) * w.posts.rows / step / step <= kMostSamples;
  });
}

/// Beside lines edges turn instead.
bool may_surround(const TileJob& job) {
  return std::holds_alternative<BoundedOptions>(job.method) && job.lines.lines.empty();
}

/// Tries the cheapest fit first: to fewer posts, and to those of the others that are out of the
/// band then; at last to all of them at once. Keeps the best.
Result<TileMesh> fit_within_budget(TileJob& job, std::stop_token stop) {
  job.surrounds = false;
  // Where posts are micrometres apart, what they are known within is more than what is asked for.
  const double known = margin_of(job), asked = job.level.fit_error_m;
  const double eps = (known < asked ? asked - known : asked / 2) * job.inner;
  const bool refines = job.whole && may_be_refined(job);
  Result<TileMesh> best = fail(Errc::internal, "no fit tried");
  int step = decimation(job);
  double place = 0;
  for (;;) {
    // Posts that the fit does not see get a share of the band to themselves.
    const double share = eps * (step == 1 ? 1 : refines ? kFirstShare : kOnlyShare);
    if (place == 0) place = place_step(job.spacing_m() * step, job.id.level, share);
    std::optional<Refinement> finer;
    if (step > 1 && refines)
      finer =
          Refinement{eps, std::min<double>(place, place_step(job.spacing_m(), job.id.level, eps))};
    auto meshed = fit(job, share, step, place, finer, stop);
    if (!meshed) return meshed;
    if (!best || badness(*meshed) < badness(*best)) best = std::move(meshed);
    if (is_good(job, *best)) return best;
    // A fine layer in a corner of a tile has more posts to the area than any that is alone.
    const std::int64_t most = (job.windows.size() > 1 ? 16 : 4) * kMeshPosts * kMeshPosts;
    const bool too_big = std::ranges::any_of(job.windows, [step, most](const LayerWindow& l) {
      const PostWindow& w = l.posts;  // its shorter side may have fewer posts than a step
      return w.cols * w.rows / step / step > most || std::max(w.cols, w.rows) / step > most;
    });
    if (step > 1 && !too_big)
      step /= 2, place = 0;  // NOLINT(bugprone-branch-clone): tried in this order
    else if (place > 1)
      place = 1;  // very steep: here the place counts
    else if (step > 1 && may_see_all(job, step / 2))
      step /= 2, place = 0;  // slow, but what is out of the band may be what no fit has seen
    else if (!job.surrounds && may_surround(job))
      job.surrounds = true;  // steep within a few units of the grid
    else
      return best;
  }
}

/// Of so many nodes a side of the tile's lattice: of one DEM in whole posts.
double node_spacing_m(const TileJob& job, int nodes) {
  if (!job.surface.only()) return tiling::tile_degrees(job.id.level) * kMetresPerDegree / nodes;
  return job.spacing_m() * std::max(1, int(job.windows.front().posts.cols / nodes));
}

/// Makes samples vertices as far as the grid has room for them; nothing vanishes for it.
void follow_nodes(const TileJob& job, const GridSamples& samples, TileMesh& mesh) {
  InsertionOptions o;
  o.limit = o.height_step = mesh.lattice.step;
  o.x_scale = x_scale(job);
  o.locked_border = o.integer_lattice = true;
  o.lattice_max = kTileExtent;
  HalfedgeMesh edited = *HalfedgeMesh::from_tin(mesh.mesh);
  DelaunayInsertion<GridSamples>(edited, samples, o).run_passes();
  mesh.mesh = edited.to_tin();
}

/// The same through the index: the mesh is fitted to nodes of the lattice, and what the posts may
/// differ from it is left of the band. How much that is differs from cell to cell, so a mesh that
/// can be refined is first fitted to few nodes within the whole budget. Over its budget where less
/// and less of a band is too little, too.
class LatticeFit {
 public:
  LatticeFit(TileJob& job, std::stop_token stop)
      : job_(job),
        lattice_(*job.lattice),
        stop_(std::move(stop)),
        margin_(margin_of(job) + kPlacingError),
        budget_(job.level.budget_m),
        room_(std::max(budget_ - lattice_.largest_residual() - margin_, kLeastRoom * budget_)) {}

  Result<TileMesh> run() {
    if (may_be_refined(job_)) return coarse_to_fine();
    TileMesh mesh;
    double band =
        std::max(kOnlyShare * room_, std::min(room_, kOnlyShare * job_.level.fit_error_m)) *
        job_.inner;
    for (int tries = 0; tries < kMostBands; ++tries, band *= kOnlyShare) {
      with_nodes(1, band, [&](const GridSamples& nodes, double place) {
        mesh = mesh_within(job_, nodes, band, place, stop_);
      });
      if (stop_.stop_requested()) return stopped();
      if (judge(mesh)) break;
    }
    return mesh;
  }

 private:
  static constexpr double kLeastRoom = 0.25;  // of the budget, where residuals leave less
  static constexpr int kMostBands = 3;        // each narrower than the one before

  TileJob& job_;
  const ResidualLattice& lattice_;
  std::stop_token stop_;
  double margin_, budget_, room_;

  static std::unexpected<Error> stopped() { return fail(Errc::cancelled, "stopped"); }

  /// f(every `step`-th node, the step of places)
  template <class F>
  void with_nodes(int step, double band, F&& f) {
    std::vector<float> heights = lattice_.fitted_heights(step);
    const int nodes = lattice_.cells / step + 1;
    if (!job_.lines.between.empty()) {
      const GridSamples samples = ResidualLattice::samples(heights, nodes);
      for (std::size_t i = 0; i < heights.size(); ++i) {
        const Vec3 p = samples.sample(i);
        if (!std::isnan(heights[i])) heights[i] = float(level_by_lines(job_, p.x, p.y, p.z));
      }
    }
    f(ResidualLattice::samples(heights, nodes),
      place_step(node_spacing_m(job_, nodes), job_.id.level, band));
  }

  bool judge(TileMesh& mesh) const {
    mesh.max_error = lattice_.any() ? lattice_bound(mesh.mesh, lattice_) + margin_ : 0;
    return mesh.max_error <= budget_;
  }

  Result<TileMesh> coarse_to_fine() {
    TileMesh mesh;
    const double whole = budget_ * job_.inner;
    with_nodes(std::max(1, lattice_.cells / kFirstNodes), whole,
               [&](const GridSamples& nodes, double place) {
                 mesh = mesh_within(job_, nodes, whole, place, stop_);
               });
    if (stop_.stop_requested()) return stopped();
    if (is_within(mesh.mesh, lattice_, budget_ - margin_) && judge(mesh)) return mesh;
    double band = std::max(room_ * job_.inner, kOnlyShare * whole);
    for (int tries = 0; tries < kMostBands; ++tries, band *= kOnlyShare) {
      with_nodes(1, band, [&](const GridSamples& nodes, double place) {
        refine(job_, nodes, band, place, stop_, mesh);
      });
      if (stop_.stop_requested()) return stopped();
      for (int pass = 0; !judge(mesh) && pass < kMostPasses; ++pass) {
        if (stop_.stop_requested()) return stopped();
        const auto missing = heights_of_cells_over(mesh.mesh, lattice_, budget_ - margin_);
        follow_nodes(job_, ResidualLattice::samples(missing, lattice_.nodes()), mesh);
      }
      if (mesh.max_error <= budget_) break;
    }
    return mesh;
  }
};

Result<TileMesh> fit_lines_as_they_are(TileJob& job, std::stop_token stop) {
  Result<TileMesh> made = job.lattice ? LatticeFit(job, stop).run() : fit_within_budget(job, stop);
  if (job.lattice && made && made->max_error > job.level.budget_m) {
    job.lattice.reset();
    if (auto done = find_rims(job); !done) return std::unexpected(done.error());
    made = fit_within_budget(job, stop);
  }
  return made;
}

/// Lets shores go around the posts beside them that are no part of the water: with a post closer to
/// a shore than the grid can tell, no mesh is within its budget.
Result<void> bend_around_posts(TileJob& job, double scale, std::stop_token stop) {
  ShoreBender bender(job.lines, job.level.budget_m, scale);
  auto done = stream_posts(job, stop, [&](const TilePosts& posts) {
    posts.visit([&](const auto& samples) {
      for (std::size_t i = 0; i < samples.size(); ++i)
        if (const Vec3 p = samples.sample(i); !std::isnan(p.z)) bender.meet(p);
    });
  });
  if (done) bender.bend(job.lines);
  return done;
}

/// How lines are led where those before leave a tile over its budget.
struct LineTry {
  double thinned = 1;   // share of the level's tolerance
  double clear = 1;     // of how far shores keep from posts
  double inner = 1;     // share of the band: rounding to the grid may leave a tile just outside
  double along = 0.25;  // share of the band that a breakline has between its vertices
};
constexpr LineTry kLineTries[] = {{1, 1, 1, 0},  // its vertices may do
                                  {1, 1},
                                  {0.25, 1},
                                  {0, 1},
                                  {1, 1, kNarrower},
                                  {0, 2},
                                  {0, 2, kNarrower},
                                  {0, 4, kNarrower},
                                  {0, 8, kNarrower}};

/// How far over its budget a tile may be, and say so, rather than show water that is not level.
constexpr double kOverForWater = 2;

/// At last without breaklines, where there are shores, too, or without lines.
Result<TileMesh> fit_with_lines(TileJob& job, std::stop_token stop) {
  const SurfaceShapes* shapes = job.surface.shapes();
  if (!shapes || shapes->lines().empty()) return fit_lines_as_they_are(job, stop);
  const LineScale scale = line_scale(job.plan, job.id.level);
  const double inner = job.inner;
  Result<TileMesh> best = fail(Errc::internal, "no fit tried");
  bool breaklines = false, shores = false;
  for (const LineTry& one : kLineTries) {
    if (&one == &kLineTries[1] && !breaklines) continue;  // it is the first
    job.inner = inner * one.inner;
    job.line_error_m = one.along * job.level.fit_error_m;
    job.lines = tile_lines(shapes->lines(), job.id, scale, job.crossings,
                           one.thinned * job.level.line_tolerance);
    breaklines = std::ranges::any_of(job.lines.lines, [](const TileLine& l) { return !l.shore; });
    shores = std::ranges::any_of(job.lines.lines, &TileLine::shore);
    if (!job.lines.lines.empty() && !job.lattice)  // which is there so that no post need be read
      if (auto bent = bend_around_posts(job, one.clear, stop); !bent)
        return std::unexpected(bent.error());
    auto made = fit_lines_as_they_are(job, stop);
    if (!made) return made;
    if (!best || made->max_error < best->max_error) best = std::move(made);
    if (best->max_error <= job.level.budget_m || job.lines.lines.empty()) break;
  }
  job.inner = inner;
  if (best->max_error <= job.level.budget_m || job.lines.lines.empty()) return best;
  if (shores && best->max_error <= kOverForWater * job.level.budget_m) return best;
  if (shores && breaklines) {
    std::erase_if(job.lines.lines, [](const TileLine& l) { return !l.shore; });
    auto level = fit_lines_as_they_are(job, stop);
    if (!level) return level;
    if (level->max_error <= kOverForWater * job.level.budget_m) {
      job.cost.without_lines = true;
      return level;
    }
  }
  job.lines = {};
  auto without = fit_lines_as_they_are(job, stop);
  if (!without || without->max_error > job.level.budget_m)
    return without ? std::move(best) : without;
  job.cost.without_lines = true;
  return without;
}

}  // namespace

int decimation(const PostWindow& w) {
  int step = 1;
  while (std::max(w.cols, w.rows) / step > kMeshPosts) step *= 2;
  return step;
}

double TileJob::spacing_m() const {
  double spacing = HUGE_VAL;
  for (const LayerWindow& w : windows)
    spacing = std::min(spacing, surface.layers()[w.layer].finest_m());
  if (!windows.empty()) return spacing;
  const DemInfo& all = surface.info();
  return surface.only() ? surface.layers()[0].finest_m()
                        : std::min(all.spacing_x_m, all.spacing_y_m);
}

/// Of one layer among others: so that its posts are not much denser in the tile than the most that
/// one layer has.
int decimation(const TileJob& job, const LayerWindow& w) {
  int step = decimation(w.posts);
  if (job.windows.size() == 1) return step;
  const double metres = tiling::tile_degrees(job.id.level) * kMetresPerDegree / (2 * kMeshPosts);
  while (step * job.surface.layers()[w.layer].finest_m() < metres &&
         2 * step < std::max(w.posts.cols, w.posts.rows))
    step *= 2;
  return step;
}

int decimation(const TileJob& job) {
  int step = 1;
  for (const LayerWindow& w : job.windows) step = std::max(step, decimation(job, w));
  return step;
}

namespace {

/// The best that job.method can do.
Result<TileMesh> fit_by_method(TileJob& job, std::stop_token stop) {
  Result<TileMesh> made = fit_with_lines(job, stop);
  if (made && made->wrong_side > 0)
    if (auto done = force_side(job, *made, stop); !done) return std::unexpected(done.error());
  return made;
}

}  // namespace

Result<TileMesh> fit_tile(TileJob& job, std::stop_token stop) {
  job.colours = tile_colours(job.plan.options(), job.id);
  Result<TileMesh> made = fit_by_method(job, stop);
  const auto enough = [&] { return !made || is_good(job, *made); };
  if (enough() || std::holds_alternative<BoundedOptions>(job.method)) return made;
  // What is measured is over the budget: a narrower band, then the method that does not give up.
  const auto instead = [&](double inner) -> Result<void> {
    job.inner = inner;
    Result<TileMesh> other = fit_by_method(job, stop);
    if (!other) return std::unexpected(other.error());
    if (badness(*other) >= badness(*made)) return {};
    made = std::move(other);
    job.cost.by_bounded = std::holds_alternative<BoundedOptions>(job.method);
    return {};
  };
  if (const auto tried = instead(kNarrower); !tried) return std::unexpected(tried.error());
  if (enough()) return made;
  job.method = BoundedOptions{};
  if (const auto tried = instead(1); !tried) return std::unexpected(tried.error());
  return made;
}

}  // namespace tind
