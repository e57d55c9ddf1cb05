#include "terrain/pyramid/build/build.h"

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>

#include "terrain/base/deflate.h"
#include "terrain/base/parallel.h"
#include "terrain/geo/tile_order.h"
#include "terrain/pyramid/build/tile_work.h"
#include "terrain/pyramid/make/make_tile.h"
#include "terrain/pyramid/plan/plan_source.h"
#include "terrain/pyramid/plan/tile_version.h"
#include "terrain/pyramid/residual/residual_index.h"
#include "terrain/raster/remote/objects.h"
#include "terrain/store/folder/folder_within.h"
#include "terrain/store/layer_place.h"
#include "terrain/store/taken_away.h"
#include "terrain/surface/surface_blocks.h"

namespace tind {

namespace {

constexpr double kLastDigit_m = 1e-6;  // stated errors are rounded up to it
constexpr std::size_t kSomeTiles = 4;  // named of those that are counted

}  // namespace

std::vector<std::uint8_t> gzipped(const std::vector<std::uint8_t>& bytes) {
  return deflate(bytes, Wrapping::gzip, 10);
}

namespace {

/// What a build knows before its first tile.
Result<TilePlan> plan_of_posts(const Surface& surface, const BuildOptions& o,
                               const TilePlan& outline, SurfaceBlocks& blocks,
                               const Progress& progress) {
  auto range = scan_heights(surface, progress, o.threads, &blocks);
  if (!range) return std::unexpected(range.error());
  if (auto done = find_level_ranges(surface, outline, *range); !done)
    return std::unexpected(done.error());
  return TilePlan::make(surface, *range, o.tiles);
}

}  // namespace

Result<UpdateReport> foresee_update(const Surface& surface, const BuildOptions& o,
                                    const Progress& progress) {
  UpdateReport update;
  if (!remote::is_remote(o.output))
    if (auto alone = folder::lies_in_no_level(o.output); !alone)
      return std::unexpected(alone.error());
  const auto outline = TilePlan::make(surface, HeightRange{}, o.tiles);
  if (!outline) return std::unexpected(outline.error());
  const auto read = open_store(o.output)->record();
  if (!read) return std::unexpected(read.error());
  const auto& record = *read;
  if (!record) return update;
  SurfaceBlocks blocks(surface);
  const auto plan = plan_of_posts(surface, o, *outline, blocks, progress);
  if (!plan) return std::unexpected(plan.error());
  const TileOrder ids = plan->order();
  const TileWork work = tile_work(surface, *plan, ids, blocks, o, update);
  if (encode(*record) == encode(work.record)) return update;
  if (!may_update(*record, work.record))
    return fail(Errc::invalid_argument,
                o.output +
                    " holds tiles that cannot become these by an update: they are of "
                    "another source or were made with other options (--force replaces them)");
  if (const auto layer = layer_of(*open_store(o.output)); layer && !o.force)
    if (auto ok = most_stay(o.output, layer->available, work.levels); !ok)
      return std::unexpected(ok.error());
  const auto kept = read_kept_blocks(o.output, *record);
  if (!kept) return std::unexpected(kept.error());
  if (const auto dirty = work.changes(*record, *kept); !dirty)
    return std::unexpected(dirty.error());
  return update;
}

Result<BuildReport> build_tiles(const Surface& surface, const BuildOptions& o,
                                const Progress& progress) {
  // The share of the work that reading every post is, more or less; twice, where an index is made.
  const bool large = deepest_indexed_level(surface, o.tiles.exact_posts) >= 0;
  const double reading = large ? 0.3 : 0.02;
  const auto outline = TilePlan::make(surface, HeightRange{}, o.tiles);
  if (!outline) return std::unexpected(outline.error());  // before anything is made
  const auto ours = o.lock(o.output);
  if (!ours) return std::unexpected(ours.error());
  SurfaceBlocks blocks(surface);
  auto plan = plan_of_posts(surface, o, *outline, blocks, progress.part(0, large ? 0.1 : reading));
  if (!plan) return std::unexpected(plan.error());
  const TileOrder ids = plan->order();
  const double looking = reading + 0.03;
  BuildReport report;
  const auto writer = (*ours)->claim(tile_work(surface, *plan, ids, blocks, o, report.update),
                                     progress.part(reading, looking));
  if (!writer) return std::unexpected(writer.error());
  TileWriter& store = **writer;
  auto index =
      index_for(surface, *plan, store.index_path(), o.threads, progress.part(0.1, reading));
  if (!index) return std::unexpected(index.error());
  if (*index) plan->use(std::move(*index));
  report.tiles = ids.size();
  report.unsound = store.unsound();
  report.threads = o.threads > 0 ? o.threads : hardware_threads();
  if (const ResidualIndex* made = plan->index()) {
    report.indexed_level = made->level() - 1;
    report.index_bytes = made->bytes();
    report.index_made = made->made_now();
  }
  for (int z = 0; z <= plan->max_level(); ++z)
    report.levels.push_back({z, 0, 0, plan->level(z).budget_m, 0});
  std::mutex mutex;
  std::optional<Error> first_error;
  std::atomic<bool> give_up = false;
  std::atomic<std::size_t> done = 0;
  double worst_excess = 0;
  parallel_for(ids.size(), o.threads, [&](std::size_t i) {
    if (give_up || progress.stopped()) return;
    const TileId id = ids[i];
    const auto there = store.finished(i);
    TileFacts known = there.value_or(TileFacts{});
    bool by_bounded = false, without_lines = false;
    if (!there) {
      auto tile = make_tile(surface, *plan, id, progress.stop);
      Result<void> written;
      if (tile) {
        by_bounded = tile->cost.by_bounded;
        without_lines = tile->cost.without_lines;
        known.max_error_m = tile->max_error_m;
        known.edge_error_m = tile->edge_error_m;
        known.not_one_sided = tile->side != o.tiles.side;
        if (o.gzip) tile->bytes = gzipped(tile->bytes);
        known.size = tile->bytes.size();
        written = store.write(
            i, {reinterpret_cast<const char*>(tile->bytes.data()), tile->bytes.size()}, known);
      }
      if (!tile || !written) {
        const std::lock_guard lock(mutex);
        if (!first_error) first_error = tile ? written.error() : tile.error();
        give_up = true;
        return;
      }
    }
    {
      const std::lock_guard lock(mutex);
      LevelReport& level = report.levels[std::size_t(id.level)];
      ++level.tiles;
      level.bytes += known.size;
      level.worst_error_m = std::max(level.worst_error_m, known.max_error_m);
      level.worst_edge_error_m = std::max(level.worst_edge_error_m, known.edge_error_m);
      report.bytes += known.size;
      ++(there ? report.reused : report.built);
      report.not_one_sided += known.not_one_sided;
      report.by_bounded += by_bounded;
      report.without_lines += without_lines;
      if (without_lines && report.some_without_lines.size() < kSomeTiles)
        report.some_without_lines.push_back(id.text());
      if (const double budget = plan->level(id).budget_m;
          known.max_error_m > budget + kLastDigit_m) {
        ++report.over_budget;
        if (known.max_error_m / budget > worst_excess) {
          worst_excess = known.max_error_m / budget;
          report.worst_over_budget = id.text();
          report.worst_over_budget_m = known.max_error_m;
          report.worst_budget_m = budget;
        }
      }
    }
    const std::size_t n = ++done;
    if (n % std::max<std::size_t>(1, ids.size() / 500) == 0)
      progress.at(looking + (1 - looking) * double(n) / double(ids.size()));
  });
  const auto committed = store.commit();  // what was made is not lost, however it ended
  if (first_error && !(first_error->code == Errc::cancelled && progress.stopped()))
    return std::unexpected(*first_error);
  if (!committed) return std::unexpected(committed.error());
  if (progress.stopped()) {
    return fail(Errc::cancelled, "stopped after " + std::to_string(done) + " of " +
                                     std::to_string(ids.size()) +
                                     " tiles; run the same command to go on");
  }
  // Who changed it since the last tile was read is not to hear that all went well.
  if (auto same = surface.unchanged(); !same) return std::unexpected(same.error());
  const std::string& file = surface.info().files.front();
  const std::string name = file.substr(file.find_last_of('/') + 1);
  proto::LayerJson layer = plan->layer(name.substr(0, name.find('.')));
  layer.version = tile_version(surface, *plan, blocks.digest());
  if (auto finished = store.finish(proto::encode_layer_json(layer)); !finished)
    return std::unexpected(finished.error());
  progress.at(1);
  return report;
}

}  // namespace tind
