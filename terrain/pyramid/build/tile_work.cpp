#include "terrain/pyramid/build/tile_work.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "terrain/pyramid/plan/dirty_tiles.h"
#include "terrain/pyramid/plan/past_build.h"
#include "terrain/pyramid/plan/tile_method.h"
#include "terrain/pyramid/plan/tile_version.h"

namespace tind {

namespace {

BuildRecord record_of(const Surface& surface, const TilePlan& plan, const SurfaceBlocks& blocks,
                      const BuildOptions& o) {
  BuildRecord r;
  r.epoch = kTileEpoch;
  r.grid = grid_digest(surface);
  r.heights = blocks.digest();
  r.max_error_m = o.tiles.max_error_m;
  r.error_factor = o.tiles.error_factor;
  r.deepest_level = plan.max_level();
  r.first_level = plan.first_level();
  r.last_level = plan.last_level();
  r.side = name_of(o.tiles.side);
  r.vertical_datum = name(surface.info().datum);
  r.effort = name_of(o.tiles.effort);
  r.method = tile_method(o.tiles);
  r.drape = drape_fingerprint(o.tiles);
  r.gzip = o.gzip;
  r.exact_posts = o.tiles.exact_posts;
  r.tiles = area_digest(plan);
  r.shapes = plan.shapes();
  r.shape_levels = plan.levels_of_shapes();
  for (int z = 0; z <= plan.max_level(); ++z) r.steps_m.push_back(plan.level(z).border_step_m);
  r.layer_epoch = layer_epoch(surface);
  r.asked_deepest = o.tiles.max_level;
  r.layers = layer_records(surface);
  r.range_m = {plan.range().min_m, plan.range().max_m};
  r.level_ranges_m = plan.range().of_levels;
  return r;
}

void count_blocks(const PastBuild& before, const SurfaceBlocks& after, const MadeOf& now,
                  UpdateReport& report) {
  for (std::size_t k = 0; k < after.layers().size(); ++k) {
    const SourceBlocks& layer = after.layers()[k];
    report.blocks += layer.size();
    report.block_posts = std::max(report.block_posts, layer.side());
    for (std::size_t i = 0; i < before.layers.size(); ++i) {
      const SourceBlocks& was = before.blocks.layers()[i];
      if (!before.layers[i].same_lattice(now.layers[k]) || was.side() != layer.side()) continue;
      for (std::int64_t y = 0; y < layer.down(); ++y)
        for (std::int64_t x = 0; x < layer.across(); ++x)
          report.changed_blocks += layer.differs(x, y, was);
      break;
    }
  }
}

std::uint64_t tiles_gone(const PastBuild& before, const BuildRecord& old, const TilePlan& plan) {
  std::uint64_t gone = 0;
  for (int z = old.first_level; z <= std::min(old.last_level, before.plan.max_level()); ++z) {
    const TileArea& area = before.plan.tiles(z);
    for (std::uint64_t i = 0; i < area.size(); ++i) {
      const auto [x, y] = area[i];
      gone += !plan.wanted({z, x, y});
    }
  }
  return gone;
}

/// Which tiles are not as they were.
std::vector<std::uint8_t> changed_tiles(const Surface& surface, const TilePlan& plan,
                                        const TileOrder& ids, const PastBuild& before,
                                        const SurfaceBlocks& blocks, const BuildRecord& old,
                                        UpdateReport& report) {
  report = {};
  report.updated = true;
  const auto layers = layer_records(surface);
  TileSetOptions whole = plan.options();
  whole.first_level = 0, whole.last_level = -1;
  const auto outline = TilePlan::make(surface, plan.range(), whole);  // as before's, without index
  assert(outline);
  const MadeOf now{layers, surface, *outline, blocks};
  DirtyTiles found =
      dirty_tiles({before.layers, before.surface, before.plan, before.blocks}, now, ids);
  count_blocks(before, blocks, now, report);
  report.everything = std::move(found.everything);
  if (report.everything.empty() && old.drape != drape_fingerprint(plan.options())) {
    report.everything = "the image that is draped is another";
    std::ranges::fill(found.flags, 1);
  }
  report.gone_layers = found.gone_layers;
  for (const std::size_t k : found.new_layers)
    report.new_layers.push_back(surface.layers()[k].name);
  for (const std::size_t k : found.bent_layers)
    report.bent_layers.push_back(surface.layers()[k].name);
  report.gone_tiles = tiles_gone(before, old, plan);
  // A level may be the median of posts far from a tile.
  const bool other_levels = old.shape_levels != plan.levels_of_shapes();
  std::vector<bool> other_steps;
  for (int z = 0; z <= plan.max_level(); ++z) {
    const bool same = std::size_t(z) < old.steps_m.size() &&
                      old.steps_m[std::size_t(z)] == plan.level(z).border_step_m;
    other_steps.push_back(!same);
    report.levels_of_other_steps += !same && std::size_t(z) < old.steps_m.size();
  }
  for (std::size_t k = 0; k < ids.size(); ++k) {
    // A tile that stands in for missing children has vertices of the next level.
    const auto z = std::size_t(ids[k].level);
    found.flags[k] = found.flags[k] || other_levels || other_steps[z] ||
                     (z + 1 < other_steps.size() && other_steps[z + 1]);
    report.dirty_tiles += found.flags[k];
  }
  return std::move(found.flags);
}

/// What the tiles of the record were made of. Of a version that did not note it: what they are made
/// of now, but for the heights.
Result<PastBuild> before(const BuildRecord& old, std::string_view blocks, const Surface& surface,
                         const TilePlan& plan) {
  BuildRecord known = old;
  if (known.layers.empty()) {
    known.layers = layer_records(surface);
    known.range_m = {plan.range().min_m, plan.range().max_m};
    known.level_ranges_m = plan.range().of_levels;
  }
  return past_build(known, blocks, plan.options());
}

}  // namespace

TileWork tile_work(const Surface& surface, const TilePlan& plan, const TileOrder& ids,
                   const SurfaceBlocks& blocks, const BuildOptions& o, UpdateReport& update) {
  const auto changes = [&](const BuildRecord& old,
                           std::string_view old_blocks) -> Result<std::vector<std::uint8_t>> {
    const auto was = before(old, old_blocks, surface, plan);
    if (!was) return std::unexpected(was.error());
    return changed_tiles(surface, plan, ids, *was, blocks, old, update);
  };
  return {.ids = ids,
          .levels = plan.layer("").available,
          .record = record_of(surface, plan, blocks, o),
          .blocks = {blocks.digest(), [&blocks] { return blocks.encode(); }},
          .changes = changes,
          .force = o.force,
          .threads = o.threads,
          .batch = o.batch};
}

}  // namespace tind
