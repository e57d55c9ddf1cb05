// One tile, from posts to bytes.
//
// The mesh lives in the tile's own integer grid (u, v in 0..32767, heights on a power-of-two step)
// from its first triangle on. So orientation is exact, quantisation is not a step that could break
// anything afterwards, and what is measured is what a client decodes.

#include "terrain/pyramid/make_tile.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "proto/quantized_mesh.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/pyramid/residual_index.h"
#include "terrain/simplify/bounded_mesher.h"
#include "terrain/tile/border.h"
#include "terrain/tile/culling.h"
#include "terrain/tile/height_field.h"
#include "terrain/tile/normals.h"
#include "terrain/tile/post_warp.h"
#include "terrain/tile/tile_posts.h"
#include "terrain/tile/triangle_order.h"

namespace tind {

namespace {

constexpr double kPlacingError = 1e-5;         // metres of height: 1e-6 m on a slope of ten
constexpr double kLargestHeightStep = 4;       // metres
constexpr std::int64_t kMeshPosts = 320;       // posts a side that a mesh is fitted to at most
constexpr std::int64_t kChunkPosts = 1 << 19;  // posts that the referee holds at a time

double power_of_two_at_most(double x) { return std::exp2(std::floor(std::log2(x))); }
double power_of_two_at_least(double x) { return std::exp2(std::ceil(std::log2(x))); }

/// Everything about one tile that several steps need.
struct Job {
  TileCost cost;
  const DemSource& source;
  const TilePlan& plan;
  TileId id;
  GeoRect rect;
  const LevelPlan& level;
  PostWindow window;
  HeightField field;
  std::array<std::vector<BorderVertex>, 4> borders;  // west, south, east, north
  double edge_error_m = 0;                           // of the worst of them
  struct Posts {
    double min_m = 0, max_m = 0;
    std::uint64_t posts = 0;
  } posts;                                 // all valid ones in the closed rectangle
  std::optional<TilePosts> whole;          // they, where not too many; offset as the level's
  std::optional<ResidualLattice> lattice;  // stands for the posts, where there are very many

  Job(const DemSource& s, const TilePlan& p, TileId t)
      : source(s), plan(p), id(t), rect(tiling::rect(t)), level(p.level(t.level)), field(s) {
    window = post_window(source, rect);
  }
};

/// Posts to be skipped between those that the mesh is fitted to: a power of two.
int decimation(const PostWindow& w) {
  int step = 1;
  while (std::max(w.cols, w.rows) / step > kMeshPosts) step *= 2;
  return step;
}

/// Adds the time until it goes out of scope.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  ~Stopwatch() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  double& seconds_;
  Clock::time_point start_ = Clock::now();
};

/// The posts around the tile, so that H is a matter of memory; coarse tiles ask the source instead.
Result<void> load_heights(Job& job) {
  const Stopwatch watch(job.cost.reading);
  if (job.window.empty() || decimation(job.window) > 1) return {};
  const DemInfo& info = job.source.info();
  const int margin = 2 + int(std::ceil(job.level.normal_reach_deg * 111320 /
                                       std::min(info.spacing_x_m, info.spacing_y_m)));
  return job.field.load(job.window.col - margin, job.window.row - margin,
                        int(job.window.cols) + 2 * margin, int(job.window.rows) + 2 * margin);
}

Result<void> derive_borders(Job& job) {
  const Stopwatch watch(job.cost.borders);
  BorderOptions o;
  o.tolerance_m = job.level.border_tolerance_m;
  o.offset_m = job.level.offset_m;
  o.height_step = job.level.border_step_m;
  o.fixed_cells = job.level.curvature_cells;
  o.samples = job.level.border_samples;
  o.place_step = job.level.border_place_step;
  o.halves = job.id.level < job.plan.max_level();
  for (const Side side : {Side::west, Side::south, Side::east, Side::north}) {
    Border border = make_border(tile_edge(job.id, side), job.field, job.source, o);
    job.borders[std::size_t(side)] = std::move(border.line);
    job.edge_error_m = std::max(job.edge_error_m, border.error_m);
  }
  if (job.field.error()) return fail("tile " + job.id.text(), *job.field.error());
  return {};
}

/// Minimum height and step of the tile's own height lattice: the finest power of two for which
/// 32767 steps span every height the tile can hold; borders stay on it, because their step is a
/// multiple.
struct HeightLattice {
  double min = 0, step = 1;
  double max() const { return min + 32767 * step; }
  std::uint16_t index(double h) const { return std::uint16_t(std::lround((h - min) / step)); }
};

HeightLattice height_lattice(const Job& job, double eps) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const auto& border : job.borders) {
    for (const BorderVertex& v : border)
      low = std::min(low, v.height), high = std::max(high, v.height);
  }
  if (job.posts.posts > 0) {
    const double offset = job.level.offset_m;
    low = std::min(low, job.posts.min_m + std::min(0.0, offset) - eps);
    high = std::max(high, job.posts.max_m + std::max(0.0, offset) + eps);
  }
  const double step =
      std::clamp(power_of_two_at_least((high - low) / 32766), 1.0 / 1024, job.level.border_step_m);
  return {std::floor(low / step) * step, step};
}

/// The rectangle with its borders and, on coarse levels, the lattice against the earth's curvature.
template <class Samples>
HalfedgeMesh frame_mesh(Job& job, const Samples& samples, double x_scale,
                        const HeightLattice& lattice) {
  constexpr double kE = kTileExtent;
  const auto& [west, south, east, north] = job.borders;
  Tin corners;
  corners.vertices = {{0, 0, south.front().height},
                      {kE, 0, south.back().height},
                      {kE, kE, north.back().height},
                      {0, kE, north.front().height}};
  corners.triangles = {{0, 1, 2}, {0, 2, 3}};
  HalfedgeMesh mesh = *HalfedgeMesh::from_tin(corners);
  InsertionOptions o;
  o.x_scale = x_scale;
  DelaunayInsertion<Samples> insertion(mesh, samples, o);
  auto inner = [](const std::vector<BorderVertex>& line, auto&& place) {
    for (std::size_t i = 1; i + 1 < line.size(); ++i) place(line[i]);
  };
  inner(west, [&](const BorderVertex& v) { insertion.insert_point({0, double(v.t), v.height}); });
  inner(south, [&](const BorderVertex& v) { insertion.insert_point({double(v.t), 0, v.height}); });
  inner(east, [&](const BorderVertex& v) { insertion.insert_point({kE, double(v.t), v.height}); });
  inner(north, [&](const BorderVertex& v) { insertion.insert_point({double(v.t), kE, v.height}); });
  const int cells = job.level.curvature_cells;
  std::vector<Geographic> places;
  std::vector<Vec3> points;
  for (int j = 1; j < cells; ++j) {
    for (int i = 1; i < cells; ++i) {
      const double u = std::round(i * kE / cells), v = std::round(j * kE / cells);
      points.push_back({u, v, 0});
      places.push_back(
          {job.rect.west + u / kE * job.rect.width(), job.rect.south + v / kE * job.rect.height()});
    }
  }
  std::vector<double> heights(places.size());
  job.field.filled(places, heights);
  for (std::size_t k = 0; k < points.size(); ++k) {
    // What fills a void may come from a post that is not the tile's own.
    const double h = std::clamp(heights[k] + job.level.offset_m, lattice.min, lattice.max());
    points[k].z = snap_height(h, lattice.step);
    insertion.insert_point(points[k]);
  }
  return mesh;
}

/// Calls f with all posts of the tile, a part of the window at a time.
template <class F>
Result<void> stream_posts(const Job& job, std::stop_token stop, F&& f) {
  if (job.window.empty()) return {};
  if (job.whole) {
    if (job.whole->inside() > 0) f(*job.whole);
    return {};
  }
  const std::int64_t rows_at_once = std::max<std::int64_t>(2, kChunkPosts / job.window.cols);
  for (std::int64_t r = 0; r < job.window.rows; r += rows_at_once) {
    if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
    PostWindow part = job.window;
    part.row += r;
    part.rows = std::min(rows_at_once, job.window.rows - r);
    const auto posts = TilePosts::read(job.source, part, job.id, 1, job.level.offset_m);
    if (!posts) return std::unexpected(posts.error());
    if (posts->inside() > 0) f(*posts);
  }
  return {};
}

Result<void> find_range(Job& job, std::stop_token stop) {
  const Stopwatch watch(job.cost.reading);
  const std::int64_t most = job.source.is_plain_geographic() ? kChunkPosts : kChunkPosts / 4;
  if (job.window.cols * job.window.rows <= most) {
    auto posts = TilePosts::read(job.source, job.window, job.id, 1, job.level.offset_m);
    if (!posts) return std::unexpected(posts.error());
    job.whole.emplace(std::move(*posts));
  }
  Job::Posts all{HUGE_VAL, -HUGE_VAL, 0};
  auto done = stream_posts(job, stop, [&](const TilePosts& posts) {
    all.min_m = std::min(all.min_m, posts.min_m());
    all.max_m = std::max(all.max_m, posts.max_m());
    all.posts += posts.inside();
  });
  job.posts = all;
  return done;
}

/// What the index knows of the posts, where the level rests on it.
Result<void> look_up_posts(Job& job) {
  auto lattice = job.plan.index()->lattice(job.id);
  if (!lattice) return std::unexpected(lattice.error());
  job.posts = {lattice->min_m, lattice->max_m, lattice->posts};
  job.lattice = std::move(*lattice);
  return {};
}

/// How far the mesh rises above a post and falls below one, at most; negative: it never does.
struct Extremes {
  double above = -HUGE_VAL, below = -HUGE_VAL;
  double error() const { return std::max({above, below, 0.0}); }
  /// How far the mesh is on the wrong side of some post that is only known within `margin`.
  double wrong(const std::string& side, double margin) const {
    if (side == "both") return 0;
    return std::max(0.0, (side == "above" ? below : above) + margin);
  }
};

/// Calls f(triangle, x, y, mesh - post) for every valid post of the closed rectangle.
template <class F>
Result<void> each_residual(const Job& job, const Tin& mesh, std::stop_token stop, F&& f) {
  return stream_posts(job, stop, [&](const TilePosts& posts) {
    posts.visit([&](const auto& samples) {
      for (const Triangle& t : mesh.triangles) {
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        const double area = orient2d(a, b, c);
        const double gx = ((b.z - a.z) * (c.y - a.y) - (c.z - a.z) * (b.y - a.y)) / area;
        const double gy = ((c.z - a.z) * (b.x - a.x) - (b.z - a.z) * (c.x - a.x)) / area;
        samples.scan(a, b, c, [&](double x, double y, double z, std::size_t) {
          f(t, x, y, a.z + gx * (x - a.x) + gy * (y - a.y) - (z - job.level.offset_m));
          return true;
        });
      }
    });
  });
}

/// The referee.
Result<Extremes> measure(const Job& job, const Tin& mesh, std::stop_token stop) {
  Extremes worst;
  auto done = each_residual(job, mesh, stop, [&](const Triangle&, double, double, double over) {
    worst.above = std::max(worst.above, over);
    worst.below = std::max(worst.below, -over);
  });
  if (!done) return std::unexpected(done.error());
  return worst;
}

struct Meshed {
  Tin mesh;
  HeightLattice lattice;
  double max_error = 0;
  double wrong_side = 0;  // one-sided tiles: how far some post is on the wrong side
};

/// Stored heights are floats, and posts of projected sources are placed by interpolation (within
/// 1e-6 m): both count as error.
double margin_of(const DemSource& source) {
  return source.info().rounding_m + (source.is_plain_geographic() ? 0 : kPlacingError);
}

/// Fits a mesh within `eps` of the samples. Its error is not known yet.
template <class Samples>
Meshed mesh_within(Job& job, const Samples& samples, double eps, double place_step,
                   std::stop_token stop) {
  const Stopwatch watch(job.cost.fitting);
  Meshed result;
  result.lattice = height_lattice(job, eps);
  const double lat = (job.rect.south + job.rect.north) / 2 * std::numbers::pi / 180;
  BoundedOptions o;
  o.eps = eps;
  if (job.posts.posts > 0) o.relief = job.posts.max_m - job.posts.min_m;
  o.x_scale = std::max(0.1, std::cos(lat));
  o.locked_border = o.integer_lattice = true;
  o.lattice_max = kTileExtent;
  o.height_step =
      std::max(result.lattice.step, std::min(kLargestHeightStep, power_of_two_at_most(eps / 8)));
  o.lattice_step = o.search_step_min = place_step;
  o.height_min = result.lattice.min;
  o.height_max = result.lattice.max();
  const std::string& effort = job.plan.options().effort;
  o.search_reach = effort == "fast" ? 0.1 : effort == "normal" ? 1 : 3;
  o.rounds = effort == "best" ? 7 : 0;
  Progress progress;
  progress.stop = stop;
  HalfedgeMesh frame = frame_mesh(job, samples, o.x_scale, result.lattice);
  o.pinned = std::uint32_t(frame.vertex_slots());
  BoundedMesher mesher(std::move(frame), samples, o);
  mesher.run(progress);
  result.mesh = mesher.mesh().to_tin();
  return result;
}

/// Fits a mesh within `eps` of every `step`-th post, then measures it over all posts.
Result<Meshed> fit(Job& job, double eps, int step, double place_step, std::stop_token stop) {
  std::optional<TilePosts> decimated;
  if (step > 1 || !job.whole) {
    auto read = TilePosts::read(job.source, job.window, job.id, step, job.level.offset_m);
    if (!read) return std::unexpected(read.error());
    decimated.emplace(std::move(*read));
  }
  const TilePosts& posts = decimated ? *decimated : *job.whole;
  Meshed result = posts.visit(
      [&](const auto& samples) { return mesh_within(job, samples, eps, place_step, stop); });
  if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
  const Stopwatch watch(job.cost.measuring);
  auto measured = measure(job, result.mesh, stop);
  if (!measured) return std::unexpected(measured.error());
  const double margin = margin_of(job.source);
  result.max_error = measured->error() + (job.posts.posts > 0 ? margin : 0);
  result.wrong_side = measured->wrong(job.plan.options().side, margin);
  return result;
}

/// Moves inner vertices until no post is on the wrong side of the mesh: where the integer grid is
/// too coarse for the posts, the error may grow, but the side is kept. Posts between border
/// vertices only cannot be helped.
Result<void> force_side(const Job& job, Meshed& m, std::stop_token stop) {
  constexpr double kLeastWeight = 0.05;
  const double margin = margin_of(job.source);
  const double up = job.plan.options().side == "above" ? 1 : -1;
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

/// Tries the cheapest fit first: fewer posts, then all of them; keeps the best.
Result<Meshed> fit_within_budget(Job& job, std::stop_token stop) {
  const double eps = job.level.fit_error_m - margin_of(job.source);
  Result<Meshed> best = fail(Errc::internal, "no fit tried");
  int step = decimation(job.window);
  double place = 0;
  for (;;) {
    // Posts that the fit does not see get a share of the band to themselves.
    const double share = step == 1 ? eps : 0.7 * eps;
    if (place == 0) place = place_step(job.source.info(), job.id.level, share, step);
    auto meshed = fit(job, share, step, place, stop);
    if (!meshed) return meshed;
    const bool better = !best || std::pair(meshed->wrong_side, meshed->max_error) <
                                     std::pair(best->wrong_side, best->max_error);
    if (better) best = std::move(meshed);
    if (best->max_error <= job.level.budget_m && best->wrong_side == 0) return best;
    const bool too_big =
        job.window.cols * job.window.rows / step / step > 4 * kMeshPosts * kMeshPosts;
    if (step > 1 && !too_big)
      step /= 2, place = 0;
    else if (place > 1)
      place = 1;  // very steep: here the place counts
    else
      return best;
  }
}

/// The same through the index: the mesh is fitted to nodes of the lattice, and what the posts may
/// differ from it is left of the band. Over its budget where that is too little.
Result<Meshed> fit_to_lattice(Job& job, std::stop_token stop) {
  const ResidualLattice& lattice = *job.lattice;
  const double margin = margin_of(job.source) + kPlacingError;
  const double room = job.level.budget_m - lattice.largest_residual() - margin;
  const double eps =
      std::min(0.7 * job.level.fit_error_m, std::max(room, 0.25 * job.level.budget_m));
  // Every fourth node of four times as fine a lattice first; all of one that is twice as fine.
  for (int step = lattice.cells >= 1024 ? lattice.cells / 256 : 1;; step /= 2) {
    const std::vector<float> heights = lattice.fitted_heights(step);
    const int nodes = lattice.cells / step + 1;
    const int posts = std::max(1, int(job.window.cols / nodes));
    Meshed meshed = mesh_within(job, ResidualLattice::samples(heights, nodes), eps,
                                place_step(job.source.info(), job.id.level, eps, posts), stop);
    if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
    meshed.max_error = lattice.posts > 0 ? lattice_bound(meshed.mesh, lattice) + margin : 0;
    if (step == 1 || meshed.max_error <= job.level.budget_m) return meshed;
  }
}

// --- encoding ------------------------------------------------------------------------------------

Geographic place_of(const Job& job, const Vec3& v) {
  const auto mix = [](double a, double b, double t) {
    return t == 0 ? a : t == kTileExtent ? b : a + t / kTileExtent * (b - a);
  };
  return {mix(job.rect.west, job.rect.east, v.x), mix(job.rect.south, job.rect.north, v.y)};
}

/// One normal per vertex from H itself, so that both tiles at an edge get the same.
std::vector<std::array<std::uint8_t, 2>> normals_of(const Job& job, const Tin& mesh) {
  const double reach = job.level.normal_reach_deg;
  std::vector<Geographic> places;
  places.reserve(5 * mesh.vertices.size());
  for (const Vec3& v : mesh.vertices) {
    Geographic p = place_of(job, v);
    if (p.lon == 180) p.lon = -180;  // one place, one normal
    places.push_back(p);
    places.push_back({p.lon - reach, p.lat});
    places.push_back({p.lon + reach, p.lat});
    places.push_back({p.lon, std::max(-90.0, p.lat - reach)});
    places.push_back({p.lon, std::min(90.0, p.lat + reach)});
  }
  std::vector<double> h(places.size());
  job.field.at(places, h);
  auto slope = [](double before, double here, double after, double metres) {
    if (metres <= 0) return 0.0;
    if (!std::isnan(before) && !std::isnan(after)) return (after - before) / (2 * metres);
    if (!std::isnan(here) && !std::isnan(after)) return (after - here) / metres;
    if (!std::isnan(here) && !std::isnan(before)) return (here - before) / metres;
    return 0.0;
  };
  std::vector<std::array<std::uint8_t, 2>> normals;
  normals.reserve(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Geographic p = places[5 * i];
    const double* at = &h[5 * i];
    const Vec2 degree = wgs84::metres_per_degree(p.lat);
    const double east = slope(at[1], at[0], at[2], reach * std::max(degree.x, 1.0));
    const double north = slope(at[3], at[0], at[4], reach * degree.y);
    normals.push_back(oct_encode(ecef_normal(p, east, north)));
  }
  return normals;
}

double round_up(double x) { return std::ceil(x * 1e6) / 1e6; }

/// Upwards to four digits: of a bound that nobody calls exact, more are not worth their bytes.
double round_up_bound(double x) {
  if (!(x > 0)) return 0;
  const double unit = std::max(1e-6, std::pow(10, std::ceil(std::log10(x)) - 4));
  return std::ceil(std::ceil(x / unit) * unit * 1e6 - 1e-3) / 1e6;
}

nlohmann::ordered_json availability(const std::vector<std::vector<proto::TileRange>>& levels) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const auto& ranges : levels) {
    json.push_back(nlohmann::ordered_json::array());
    for (const proto::TileRange& r : ranges)
      json.back().push_back(
          {{"startX", r.start_x}, {"startY", r.start_y}, {"endX", r.end_x}, {"endY", r.end_y}});
  }
  return json;
}

TileBytes encode_tile(Job& job, const Meshed& meshed) {
  const Stopwatch watch(job.cost.encoding);
  proto::QuantizedMesh q;
  const HeightLattice& lattice = meshed.lattice;
  std::vector<Vec3> places;
  places.reserve(meshed.mesh.vertices.size());
  for (const Vec3& v : meshed.mesh.vertices) {
    q.u.push_back(std::uint16_t(v.x));
    q.v.push_back(std::uint16_t(v.y));
    q.h.push_back(lattice.index(v.z));
    const Geographic p = place_of(job, v);
    places.push_back({p.lon, p.lat, v.z});
  }
  q.triangles = coherent_order(meshed.mesh);
  q.oct_normals = normals_of(job, meshed.mesh);
  q.min_height = float(lattice.min);
  q.max_height = float(lattice.max());
  const CullingVolumes volumes = culling_volumes(job.rect, places);
  q.center = {volumes.center.x, volumes.center.y, volumes.center.z};
  q.bounding_sphere = {volumes.sphere_center.x, volumes.sphere_center.y, volumes.sphere_center.z,
                       volumes.sphere_radius};
  q.horizon_occlusion = {volumes.horizon_occlusion.x, volumes.horizon_occlusion.y,
                         volumes.horizon_occlusion.z};
  TileBytes tile;
  tile.max_error_m = round_up(meshed.max_error);
  tile.exact =
      !job.lattice && job.source.info().rounding_m == 0 && job.source.is_plain_geographic();
  // A tile that could not be kept on one side says so: then it is like any other.
  if (meshed.wrong_side == 0) tile.side = job.plan.options().side;
  nlohmann::ordered_json metadata;
  metadata["geometricerror"] = tile.max_error_m;
  metadata["max_error_m"] = tile.max_error_m;
  metadata["error_kind"] = tile.exact ? "exact" : "bound";
  metadata["edge_error_m"] = tile.edge_error_m = round_up_bound(job.edge_error_m);
  if (job.plan.options().side != "both") metadata["side"] = tile.side;
  metadata["posts"] = job.posts.posts;
  if (job.lattice) metadata["residual_m"] = round_up(job.lattice->largest_residual());
  if (job.id.level % TilePlan::kAvailabilityLevels == 0)
    metadata["available"] = availability(job.plan.descendants(job.id));
  q.metadata = metadata.dump();
  proto::arrange(q);
  tile.bytes = proto::encode(q);
  return tile;
}

}  // namespace

Result<TileBytes> make_tile(const DemSource& source, const TilePlan& plan, TileId id,
                            std::stop_token stop) {
  Job job(source, plan, id);
  if (auto done = load_heights(job); !done) return fail("tile " + id.text(), done.error());
  if (auto done = derive_borders(job); !done) return std::unexpected(done.error());
  const bool indexed = plan.index() && plan.index()->serves(id.level) && !job.window.empty();
  auto known = indexed ? look_up_posts(job) : find_range(job, stop);
  if (!known) return fail("tile " + id.text(), known.error());
  auto meshed = indexed ? fit_to_lattice(job, stop) : fit_within_budget(job, stop);
  if (indexed && meshed && meshed->max_error > job.level.budget_m) {
    job.lattice.reset();
    meshed = fit_within_budget(job, stop);
  }
  if (meshed && meshed->wrong_side > 0)
    if (auto done = force_side(job, *meshed, stop); !done) meshed = std::unexpected(done.error());
  if (!meshed) return fail("tile " + id.text(), meshed.error());
  TileBytes tile = encode_tile(job, *meshed);
  if (job.field.error()) return fail("tile " + id.text(), *job.field.error());
  tile.cost = job.cost;
  return tile;
}

}  // namespace tind
