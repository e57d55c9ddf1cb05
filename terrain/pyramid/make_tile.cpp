// One tile, from posts to bytes: what is known of its surroundings, then the mesh (tile_fit.cpp),
// then the bytes (tile_encode.cpp).
//
// The mesh lives in the tile's own integer grid (u, v in 0..32767, heights on a power-of-two step)
// from its first triangle on. So orientation is exact, quantisation is not a step that could break
// anything afterwards, and what is measured is what a client decodes.

#include "terrain/pyramid/make_tile.h"

#include <algorithm>
#include <cmath>

#include "terrain/pyramid/residual_index.h"
#include "terrain/pyramid/tile_job.h"

namespace tind {

namespace {

constexpr std::int64_t kChunkPosts = 1 << 19;  // posts that the referee holds at a time

/// The posts around the tile, so that H is a matter of memory; coarse tiles ask the source instead.
Result<void> load_heights(TileJob& job) {
  const Stopwatch watch(job.cost.reading);
  if (job.window.empty() || decimation(job.window) > 1) return {};
  const DemInfo& info = job.source.info();
  const int margin = 2 + int(std::ceil(job.level.normal_reach_deg * 111320 /
                                       std::min(info.spacing_x_m, info.spacing_y_m)));
  return job.field.load(job.window.col - margin, job.window.row - margin,
                        int(job.window.cols) + 2 * margin, int(job.window.rows) + 2 * margin);
}

Result<void> derive_borders(TileJob& job) {
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

Result<void> find_range(TileJob& job, std::stop_token stop) {
  const Stopwatch watch(job.cost.reading);
  const std::int64_t most = job.source.is_plain_geographic() ? kChunkPosts : kChunkPosts / 4;
  if (job.window.cols * job.window.rows <= most) {
    auto posts = TilePosts::read(job.source, job.window, job.id, 1, job.level.offset_m);
    if (!posts) return std::unexpected(posts.error());
    job.whole.emplace(std::move(*posts));
  }
  TileJob::Posts all{HUGE_VAL, -HUGE_VAL, 0};
  auto done = stream_posts(job, stop, [&](const TilePosts& posts) {
    all.min_m = std::min(all.min_m, posts.min_m());
    all.max_m = std::max(all.max_m, posts.max_m());
    all.posts += posts.inside();
  });
  job.posts = all;
  return done;
}

/// What the index knows of the posts, where the level rests on it.
Result<void> look_up_posts(TileJob& job) {
  auto lattice = job.plan.index()->lattice(job.id);
  if (!lattice) return std::unexpected(lattice.error());
  job.posts = {lattice->min_m, lattice->max_m, lattice->posts};
  job.lattice = std::move(*lattice);
  return {};
}

}  // namespace

Result<void> stream_posts(const TileJob& job, std::stop_token stop,
                          const std::function<void(const TilePosts&)>& f) {
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

Result<TileBytes> make_tile(const DemSource& source, const TilePlan& plan, TileId id,
                            std::stop_token stop) {
  TileJob job(source, plan, id);
  if (auto done = load_heights(job); !done) return fail("tile " + id.text(), done.error());
  if (auto done = derive_borders(job); !done) return std::unexpected(done.error());
  const bool indexed = plan.index() && plan.index()->serves(id.level) && !job.window.empty();
  auto known = indexed ? look_up_posts(job) : find_range(job, stop);
  if (!known) return fail("tile " + id.text(), known.error());
  const auto meshed = fit_tile(job, stop);
  if (!meshed) return fail("tile " + id.text(), meshed.error());
  TileBytes tile = encode_tile(job, *meshed);
  if (job.field.error()) return fail("tile " + id.text(), *job.field.error());
  tile.cost = job.cost;
  return tile;
}

}  // namespace tind
