#include "terrain/pyramid/build/tile_work.h"

#include <utility>

#include "terrain/pyramid/plan/dirty_tiles.h"
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
  r.gzip = o.gzip;
  r.exact_posts = o.tiles.exact_posts;
  r.tiles = area_digest(plan);
  r.shapes = plan.shapes();
  r.shape_levels = plan.levels_of_shapes();
  for (int z = 0; z <= plan.max_level(); ++z) r.steps_m.push_back(plan.level(z).border_step_m);
  return r;
}

/// Which tiles depend on heights that changed.
std::vector<std::uint8_t> tiles_of_changes(const Surface& surface, const TilePlan& plan,
                                           const TileOrder& ids, const SurfaceBlocks& before,
                                           const SurfaceBlocks& after, const BuildRecord& old,
                                           UpdateReport& report) {
  report.updated = true;
  for (std::size_t k = 0; k < after.layers().size(); ++k) {
    const SourceBlocks& layer = after.layers()[k];
    report.blocks += layer.size();
    report.block_posts = std::max(report.block_posts, layer.side());
    for (const std::uint8_t differs : layer.difference(before.layers()[k]))
      report.changed_blocks += differs;
  }
  std::vector<std::uint8_t> dirty = dirty_tiles(surface, plan, ids, before, after);
  // A level may be the median of posts far from a tile.
  const bool other_levels = old.shape_levels != plan.levels_of_shapes();
  std::vector<bool> other_steps;
  for (int z = 0; z <= plan.max_level(); ++z) {
    const bool same = std::size_t(z) < old.steps_m.size() &&
                      old.steps_m[std::size_t(z)] == plan.level(z).border_step_m;
    other_steps.push_back(!same);
    report.levels_of_other_steps += !same;
  }
  for (std::size_t k = 0; k < ids.size(); ++k) {
    // A tile that stands in for missing children has vertices of the next level.
    const auto z = std::size_t(ids[k].level);
    dirty[k] = dirty[k] || other_levels || other_steps[z] ||
               (z + 1 < other_steps.size() && other_steps[z + 1]);
    report.dirty_tiles += dirty[k];
  }
  return dirty;
}

}  // namespace

TileWork tile_work(const Surface& surface, const TilePlan& plan, const TileOrder& ids,
                   const SurfaceBlocks& blocks, const BuildOptions& o, UpdateReport& update) {
  const auto changes = [&](const BuildRecord& old,
                           std::string_view old_blocks) -> Result<std::vector<std::uint8_t>> {
    const auto before = SurfaceBlocks::decode(old_blocks, surface, old.heights);
    if (!before) return std::unexpected(before.error());
    return tiles_of_changes(surface, plan, ids, *before, blocks, old, update);
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
