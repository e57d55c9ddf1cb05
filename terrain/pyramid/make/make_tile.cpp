// One tile, from posts to its model: what is known of its surroundings, then the mesh
// (tile_fit.cpp), then all that encodings need (tile_finish.cpp).
//
// The mesh lives in the tile's own integer grid (u, v in 0..32767, heights on a power-of-two step)
// from its first triangle on. So orientation is exact, quantisation is not a step that could break
// anything afterwards, and what is measured is what a client decodes.

#include "terrain/pyramid/make/make_tile.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "terrain/base/power_of_two.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/pyramid/make/tile_job.h"
#include "terrain/pyramid/residual/indexed_edges.h"
#include "terrain/pyramid/residual/residual_index.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/surface/post_warp.h"
#include "terrain/surface/rim_samples.h"

namespace tind {

namespace {

constexpr double kMostMargin = 320;  // posts, as many as a tile has where this pays
/// A tile's posts are held, for the referee and for the mesh to be refined to, where there are no
/// more than this of them: 32 MB, an eighth where each has a place of its own.
constexpr std::int64_t kWholePosts = 1 << 23;
/// Nor more than so many in a row or column: the few posts of a long thin window are not refined
/// to.
constexpr std::int64_t kWholeSide = 4096;

/// The posts around the tile, so that H is a matter of memory; coarse tiles ask the source instead.
/// Normals look farther the coarser the tile is, but not where a small source has ended long
/// before: beyond the margin H asks the source, too.
Result<void> load_heights(TileJob& job) {
  const Stopwatch watch(job.cost.reading);
  std::optional<std::size_t> loaded;
  for (const auto& [layer, w, step, alone] : job.windows) {
    if (decimation(w) > 1 || loaded == layer) continue;  // of two windows the wider one
    loaded = layer;
    const DemInfo& info = job.surface.layers()[layer].source->info();
    const double reach =
        job.level.normal_reach_deg * 111320 / std::min(info.spacing_x_m, info.spacing_y_m);
    const int margin = 2 + int(std::ceil(std::min(reach, kMostMargin)));
    auto done = job.field.load(layer, w.col - margin, w.row - margin, int(w.cols) + 2 * margin,
                               int(w.rows) + 2 * margin);
    if (!done) return done;
  }
  return {};
}

std::vector<BorderSample> border_samples(const std::vector<ShapeCrossing>& crossings) {
  std::vector<BorderSample> samples;
  samples.reserve(crossings.size());
  for (const ShapeCrossing& c : crossings)
    samples.push_back({c.t, c.shore ? c.height_m : std::numeric_limits<double>::quiet_NaN()});
  return samples;
}

/// Where the dataset's lines cross an edge, as options of its border and as vertices of it.
CrossingVertices cross_lines(const TileJob& job, int z, const TileEdge& edge, BorderOptions& o) {
  const SurfaceShapes* shapes = job.surface.shapes();
  if (!shapes || shapes->lines().empty()) return {};
  const auto crossings = shapes->lines().crossings(edge.start, edge.end, line_scale(job.plan, z));
  o.crossings = border_samples(crossings);
  CrossingVertices vertices(crossings, std::max(1, int(job.plan.level(z).line_tolerance / 4)));
  for (const CrossingVertices::Vertex& v : vertices.all())
    o.lines.push_back(
        {v.crossing, v.t, v.shore ? std::numeric_limits<double>::quiet_NaN() : v.height_m});
  if (o.halves) {
    const Geographic middle{(edge.start.lon + edge.end.lon) / 2,
                            (edge.start.lat + edge.end.lat) / 2};
    const LineScale next = line_scale(job.plan, z + 1);
    o.crossings_of_half[0] = border_samples(shapes->lines().crossings(edge.start, middle, next));
    o.crossings_of_half[1] = border_samples(shapes->lines().crossings(middle, edge.end, next));
  }
  return vertices;
}

/// The tile's children along a side, the southern or western first.
std::pair<TileId, TileId> children_at(TileId id, TileSide side) {
  if (side == TileSide::west || side == TileSide::east) {
    const bool east = side == TileSide::east;
    return {id.child(east, false), id.child(east, true)};
  }
  const bool north = side == TileSide::north;
  return {id.child(false, north), id.child(true, north)};
}

/// Where a layer ends, tiles keep its bound, which is stricter than their level's, while posts of a
/// finer layer may lie closer together than the samples of their edges: there samples are no
/// farther apart than the bound, as those of a level are. Else posts beside the edge, where no
/// vertex can be, are farther from it than the bound.
int edge_samples(const Surface& surface, const TilePlan& plan, const LevelPlan& level, int z,
                 const TileEdge& e) {
  constexpr double kMost = 1 << 16;
  const int usual = level.border_samples;
  if (surface.only() || level.budget_m >= tiling::level_error(z) * plan.options().error_factor)
    return usual;
  const double metres = tiling::tile_degrees(z) * 111320;
  const GeoRect edge{e.start.lon, e.start.lat, e.end.lon, e.end.lat};
  bool finer = false;
  for (std::size_t k = 0; k < surface.layers().size() && !finer; ++k)
    finer = surface.layers()[k].finest_m() * usual < metres && surface.reaches(k, edge);
  if (!finer) return usual;
  const double wanted = power_of_two_at_most(metres / level.budget_m);
  return int(std::clamp(wanted, double(usual), kMost));
}

/// Do tiles of a level, all of which rest on the index, have their edges from there?
bool edges_from_index(const TilePlan& plan, int z) {
  return plan.index() && plan.local_steps() && z < plan.index_depth().level();
}

/// From the nodes of the index, which are H within half a step. What the next level knows of the
/// edge are nodes, too, or, of the first whose tiles do not rest on the index, H itself.
Result<Border> border_from_index(const TileJob& job, TileId id, TileSide side,
                                 const BorderOptions& o) {
  IndexedEdges edges(*job.plan.index());
  auto own = edges.profile(id, side);
  if (!own) return std::unexpected(own.error());
  EdgeProfile halves;
  if (o.halves && edges_from_index(job.plan, id.level + 1)) {
    const auto [first, second] = children_at(id, side);
    auto a = edges.profile(first, side), b = edges.profile(second, side);
    if (!a) return std::unexpected(a.error());
    if (!b) return std::unexpected(b.error());
    halves = joined(*a, *b);
  } else if (o.halves) {
    halves = halves_of(tile_edge(id, side), job.field, job.surface, o);
  }
  Border border = make_border(*own, o.halves ? &halves : nullptr, o);
  border.error_m += job.plan.index_depth().step_m() / 2;
  return border;
}

Result<Border> border_of(const TileJob& job, TileId id, TileSide side, const HeightSteps& steps,
                         CrossingVertices* crossings = nullptr) {
  const LevelPlan& level = job.plan.level(id, side);
  BorderOptions o;
  o.tolerance_m = level.border_tolerance_m;
  o.offset_m = level.offset_m;
  o.height_step = steps.sides[std::size_t(side)];
  o.step_at_start = steps.ends[std::size_t(side)][0];
  o.step_at_end = steps.ends[std::size_t(side)][1];
  o.fixed_cells = level.curvature_cells;
  o.samples = edge_samples(job.surface, job.plan, level, id.level, tile_edge(id, side));
  o.place_step = level.border_place_step;
  o.lowest_m = level.lowest_m, o.highest_m = level.highest_m;
  o.halves = id.level < job.plan.max_level();
  if (o.halves)
    for (const int half : {0, 1}) {
      const auto children = children_at(id, side);
      const TileId child = half == 0 ? children.first : children.second;
      o.samples_of_half[half] = edge_samples(job.surface, job.plan, job.plan.level(child, side),
                                             child.level, tile_edge(child, side));
    }
  if (edges_from_index(job.plan, id.level)) return border_from_index(job, id, side, o);
  const CrossingVertices vertices = cross_lines(job, id.level, tile_edge(id, side), o);
  if (crossings) *crossings = vertices;
  return make_border(tile_edge(id, side), job.field, job.surface, o);
}

/// Water is level on its own level of the pyramid: where the line of a child's border lies in it,
/// or meets its shore, it has this tile's rounding of the water's level, not the child's.
void level_in_water(const TileJob& job, const TileEdge& edge, const CrossingVertices& shores,
                    std::vector<BorderVertex>& line) {
  const SurfaceShapes* shapes = job.surface.shapes();
  if (!shapes || shapes->lines().empty()) return;
  const LineScale scale = line_scale(job.plan, job.id.level);
  LineScale unrounded = line_scale(job.plan, job.id.level + 1);
  unrounded.step_m = 0;
  const auto crossings = shapes->lines().crossings(edge.start, edge.end, unrounded);
  for (BorderVertex& v : line) {
    const auto shore = std::ranges::find_if(
        shores.all(), [&](const CrossingVertices::Vertex& s) { return s.shore && s.t == v.t; });
    if (shore != shores.all().end()) {
      const auto crossing = std::ranges::find(crossings, shore->crossing, &ShapeCrossing::t);
      if (crossing != crossings.end() && crossing->shore)
        v.height = scale.level(crossing->height_m);
      continue;
    }
    const double share = double(v.t) / kTileExtent;
    const Geographic place{edge.start.lon + share * (edge.end.lon - edge.start.lon),
                           edge.start.lat + share * (edge.end.lat - edge.start.lat)};
    if (const auto level = shapes->level_at(place)) v.height = scale.level(*level);
  }
}

/// Where a child has no tile, clients draw this tile's part in its stead, beside its sibling, which
/// has one. No post holds the mesh there: so the sibling's border does, from the middle of the tile
/// to shortly before its own border, which has no vertex there as a rule.
Result<void> stand_in_for_children(TileJob& job, const std::stop_token& stop) {
  if (job.id.level >= job.plan.max_level()) return {};
  const auto child = [&](std::uint32_t east, std::uint32_t north) {
    return TileId{job.id.level + 1, 2 * job.id.x + east, 2 * job.id.y + north};
  };
  constexpr int kClear = kTileExtent / 64;  // of the child's border
  struct Line {
    TileId before, after;  // south and north of it, or west and east
    TileSide side_of_before, side_of_after;
    bool northward;
    int start;  // along it, in halves of the tile
  };
  const Line lines[] = {{child(0, 0), child(1, 0), TileSide::east, TileSide::west, true, 0},
                        {child(0, 1), child(1, 1), TileSide::east, TileSide::west, true, 1},
                        {child(0, 0), child(0, 1), TileSide::north, TileSide::south, false, 0},
                        {child(1, 0), child(1, 1), TileSide::north, TileSide::south, false, 1}};
  const double middle = std::round(kTileExtent / 2.0);
  for (const Line& l : lines) {
    const bool before = job.plan.available(l.before), after = job.plan.available(l.after);
    if (before == after) continue;
    const TileId beside = before ? l.before : l.after;
    const TileSide side = before ? l.side_of_before : l.side_of_after;
    CrossingVertices shores;
    const auto steps = height_steps(job.surface, job.plan, beside, stop);
    if (!steps) return std::unexpected(steps.error());
    auto border = border_of(job, beside, side, *steps, &shores);
    if (!border) return std::unexpected(border.error());
    level_in_water(job, tile_edge(beside, side), shores, border->line);
    std::vector<Vec3> line;
    const auto add = [&](double t, double height) {
      const double along = std::round((t + l.start * kTileExtent) / 2.0);
      line.push_back(l.northward ? Vec3{middle, along, height} : Vec3{along, middle, height});
    };
    const std::vector<BorderVertex>& all = border->line;
    const auto between = [&](const BorderVertex& p, const BorderVertex& q, int t) {
      add(t, p.height + double(t - p.t) / (q.t - p.t) * (q.height - p.height));
    };
    const int from = l.start == 0 ? kClear : 0, to = kTileExtent - (l.start == 0 ? 0 : kClear);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (i > 0 && all[i - 1].t < from && all[i].t > from) between(all[i - 1], all[i], from);
      if (i > 0 && all[i - 1].t < to && all[i].t > to) between(all[i - 1], all[i], to);
      if (all[i].t >= from && all[i].t <= to) add(all[i].t, all[i].height);
    }
    job.stand_in.push_back(std::move(line));
  }
  return {};
}

Result<void> derive_borders(TileJob& job, const std::stop_token& stop) {
  const Stopwatch watch(job.cost.borders);
  for (const TileSide side : {TileSide::west, TileSide::south, TileSide::east, TileSide::north}) {
    auto border = border_of(job, job.id, side, job.steps, &job.crossings[std::size_t(side)]);
    if (!border) return fail("tile " + job.id.text(), border.error());
    job.borders[std::size_t(side)] = std::move(border->line);
    job.edge_error_m = std::max(job.edge_error_m, border->error_m);
  }
  if (auto done = stand_in_for_children(job, stop); !done)
    return fail("tile " + job.id.text(), done.error());
  if (job.field.error()) return fail("tile " + job.id.text(), *job.field.error());
  return {};
}

Result<void> find_range(TileJob& job, std::stop_token stop) {
  const Stopwatch watch(job.cost.reading);
  if (auto done = find_rims(job); !done) return done;
  std::int64_t count = 0, side = 0;
  for (const LayerWindow& w : job.windows) {
    count += w.posts.cols * w.posts.rows;
    side = std::max({side, w.posts.cols, w.posts.rows});
  }
  const std::int64_t most = side > kWholeSide ? kPartPosts : kWholePosts;
  if (count <= (job.surface.is_plain_geographic() ? most : most / 8)) {
    auto posts = TilePosts::read(job.field, job.windows, job.id, job.level.offset_m, job.beside);
    if (!posts) return std::unexpected(posts.error());
    job.whole.emplace(std::move(*posts));
  }
  TileJob::Posts all;
  auto done = stream_posts(job, stop, [&](const TilePosts& posts) {
    all.min_m = std::min(all.min_m, posts.min_m());
    all.max_m = std::max(all.max_m, posts.max_m());
    all.posts += posts.inside();
  });
  job.posts = all;
  return done;
}

/// What the index knows of the posts, where the tile rests on it.
Result<void> look_up_posts(TileJob& job) {
  auto lattice = job.plan.index()->lattice(job.id);
  if (!lattice) return std::unexpected(lattice.error());
  if (lattice->any()) job.posts = {lattice->min_m, lattice->max_m, lattice->posts};
  job.lattice = std::move(*lattice);
  return {};
}

}  // namespace

Result<void> find_rims(TileJob& job) {
  if (job.alone()) return {};
  auto beside = rim_samples(job.field, job.id);
  if (!beside) return std::unexpected(beside.error());
  job.beside = std::move(*beside);
  return {};
}

Result<void> stream_posts(const TileJob& job, std::stop_token stop,
                          const std::function<void(const TilePosts&)>& f) {
  if (job.whole) {
    if (!job.whole->empty()) f(*job.whole);
    return {};
  }
  if (!job.beside.empty()) f(TilePosts::of_samples(job.beside, job.level.offset_m));
  for (const LayerWindow& window : job.windows)
    for (const LayerWindow& part : parts_of(window)) {
      if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
      const auto posts = TilePosts::read(job.field, {&part, 1}, job.id, job.level.offset_m);
      if (!posts) return std::unexpected(posts.error());
      if (!posts->empty()) f(*posts);
    }
  return {};
}

Result<TileModel> model_tile(const Surface& surface, const TilePlan& plan, TileId id,
                             std::stop_token stop, TileCost* cost) {
  TileJob job(surface, plan, id);
  auto windows = surface_windows(surface, job.rect);
  if (!windows) return fail("tile " + id.text(), windows.error());
  job.windows = std::move(*windows);
  if (auto done = load_heights(job); !done) return fail("tile " + id.text(), done.error());
  auto steps = height_steps(surface, plan, id, stop);
  if (!steps) return fail("tile " + id.text(), steps.error());
  job.steps = *steps;
  if (auto done = derive_borders(job, stop); !done) return std::unexpected(done.error());
  const bool indexed = plan.index() && plan.index()->serves(id) && !job.windows.empty();
  auto known = indexed ? look_up_posts(job) : find_range(job, stop);
  if (!known) return fail("tile " + id.text(), known.error());
  const auto meshed = fit_tile(job, stop);
  if (!meshed) return fail("tile " + id.text(), meshed.error());
  auto tile = finish_tile(job, *meshed);
  if (!tile) return fail("tile " + id.text(), tile.error());
  if (job.field.error()) return fail("tile " + id.text(), *job.field.error());
  if (cost) *cost = job.cost;
  return tile;
}

Result<TileBytes> make_tile(const Surface& surface, const TilePlan& plan, TileId id,
                            std::stop_token stop) {
  TileBytes tile;
  const auto model = model_tile(surface, plan, id, std::move(stop), &tile.cost);
  if (!model) return std::unexpected(model.error());
  const Stopwatch watch(tile.cost.encoding);
  tile.bytes = encode_quantized_mesh(*model);
  const TileCertificate& says = *model->certificate;
  tile.max_error_m = says.max_error_m, tile.edge_error_m = says.edge_error_m;
  tile.exact = says.exact, tile.side = says.side;
  tile.posts = model->posts;
  return tile;
}

}  // namespace tind
