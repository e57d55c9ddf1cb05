#include "terrain/pyramid/shards/plan_shards.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "terrain/base/parallel.h"
#include "terrain/pyramid/build/repair.h"
#include "terrain/pyramid/build/tile_work.h"
#include "terrain/pyramid/plan/dirty_tiles.h"
#include "terrain/pyramid/plan/tile_version.h"
#include "terrain/pyramid/residual/residual_index.h"
#include "terrain/store/copy/copy_store.h"
#include "terrain/surface/surface_blocks.h"
#include "terrain/surface/tile_posts.h"
#include "terrain/surface/void_fill.h"

namespace tind {

namespace {

constexpr std::uint64_t kSubtreesEach = 8;  // of a shard, at least, so that costs can be evened out
constexpr int kLooks = 8;                   // a side, at a subtree, for voids
constexpr std::uint64_t kVoidTile = 32;     // its cost; of one without voids kLooks^2 more

/// The first level that will do.
Result<int> level_of_shards(const TilePlan& plan, std::uint64_t shards) {
  const int first = std::max(plan.first_level(), plan.index_depth().level());
  if (first > plan.last_level())
    return fail(Errc::invalid_argument,
                "all tiles of these levels rest on the residual index, which one machine makes: "
                "tind build makes them");
  for (int z = first; z <= plan.last_level(); ++z)
    if (plan.tiles(z).size() >= kSubtreesEach * shards) return z;
  return plan.last_level();
}

Result<std::uint64_t> number_of_shards(const TilePlan& plan, const ShardWish& wish) {
  const std::uint64_t most =
      std::min<std::uint64_t>(kMostShards, plan.tiles(plan.last_level()).size());
  if (wish.shards > most)
    return fail(Errc::invalid_argument, "at most " + std::to_string(most) +
                                            " shards: a shard has a tile of the deepest level");
  if (wish.shards > 0) return wish.shards;
  const std::uint64_t each = std::max<std::uint64_t>(1, wish.tiles_per_shard);
  return std::clamp<std::uint64_t>((plan.tile_count() + each - 1) / each, 1, most);
}

/// Of so many places in a tile, how many are at posts.
std::uint64_t places_with_posts(const Surface& surface, const SurfaceBlocks& blocks, TileId id) {
  const GeoRect r = tiling::rect(id);
  std::array<Geographic, kLooks * kLooks> places;
  for (std::size_t j = 0; j < kLooks; ++j)
    for (std::size_t i = 0; i < kLooks; ++i)
      places[j * kLooks + i] = {r.west + (i + 0.5) / kLooks * r.width(),
                                r.south + (j + 0.5) / kLooks * r.height()};
  std::array<bool, kLooks * kLooks> found{};
  std::array<Vec2, kLooks * kLooks> posts;
  for (std::size_t k = 0; k < surface.layers().size(); ++k) {
    surface.layers()[k].source->to_post(places, posts);
    const SourceBlocks& layer = blocks.layers()[k];
    for (std::size_t n = 0; n < posts.size(); ++n) {
      const Vec2 p = posts[n];
      if (!(p.x >= 0 && p.y >= 0 && p.x < double(layer.cols()) && p.y < double(layer.rows())))
        continue;
      const auto col = std::int64_t(p.x) / layer.side(), row = std::int64_t(p.y) / layer.side();
      found[n] = found[n] || !layer.all_void(col, row);
    }
  }
  return std::uint64_t(std::ranges::count(found, true));
}

std::uint64_t tiles_below(const TilePlan& plan, TileId root) {
  std::uint64_t count = 0;
  for (int z = root.level; z <= plan.last_level(); ++z) {
    const int down = z - root.level;
    const TileRange below{root.x << down, root.y << down, ((root.x + 1) << down) - 1,
                          ((root.y + 1) << down) - 1};
    for (const TileRange& r : plan.tiles(z).within(below)) count += r.size();
  }
  return count;
}

/// Runs of about the same cost; each has a subtree.
void cut(ShardPlan& plan, const std::vector<ShardPlan::Shard>& subtrees, std::uint64_t shards) {
  std::uint64_t all = 0;
  for (const auto& s : subtrees) all += s.cost;
  std::uint64_t before = 0;
  std::size_t at = 0;
  for (std::uint64_t i = 0; i < shards; ++i) {
    ShardPlan::Shard shard;
    const std::size_t last = subtrees.size() - std::size_t(shards - 1 - i);  // leave one each
    const std::uint64_t until = all / shards * (i + 1) + all % shards * (i + 1) / shards;
    do {
      const ShardPlan::Shard& s = subtrees[at++];
      shard.subtrees += 1, shard.tiles += s.tiles, shard.cost += s.cost;
      before += s.cost;
      // The next one, where that comes nearer to the share.
    } while (at < last && before + subtrees[at].cost / 2 < until);
    if (i + 1 == shards)
      for (; at < subtrees.size(); ++at)
        shard.subtrees += 1, shard.tiles += subtrees[at].tiles, shard.cost += subtrees[at].cost;
    plan.shards.push_back(shard);
  }
}

/// What tind build calls the layer.
std::string layer_name(const Surface& surface) {
  const std::string& file = surface.info().files.front();
  const std::string name = file.substr(file.find_last_of('/') + 1);
  return name.substr(0, name.find('.'));
}

BuildRecord record_of(const Surface& surface, const TilePlan& plan, const SurfaceBlocks& blocks,
                      const BuildOptions& o) {
  UpdateReport none;
  const TileOrder ids = plan.order();
  return tile_work(surface, plan, ids, blocks, o, none).record;
}

}  // namespace

Result<ShardPlan> plan_shards(const Surface& surface, const BuildOptions& o, const ShardWish& wish,
                              PlannedSource source, const Progress& progress) {
  const auto outline = TilePlan::make(surface, HeightRange{}, o.tiles);
  if (!outline) return std::unexpected(outline.error());
  if (outline->tile_count() > kMostCopiedTiles)
    return fail(Errc::out_of_range,
                std::to_string(outline->tile_count()) + " tiles are more than the " +
                    std::to_string(kMostCopiedTiles / 1'000'000) +
                    " million that can be joined at the end: a larger --max-error, fewer --levels, "
                    "or a plan for each part of the DEM");
  const auto shards = number_of_shards(*outline, wish);
  if (!shards) return std::unexpected(shards.error());
  const auto level = level_of_shards(*outline, *shards);
  if (!level) return std::unexpected(level.error());
  if (outline->tiles(*level).size() > kMostSubtrees)
    return fail(Errc::out_of_range, "too many shards: each would be a few tiles");
  SurfaceBlocks blocks(surface);
  auto range = scan_heights(surface, progress.part(0, 0.9), o.threads, &blocks);
  if (!range) return std::unexpected(range.error());
  if (auto done = find_level_ranges(surface, *outline, *range); !done)
    return std::unexpected(done.error());
  const auto tiles = TilePlan::make(surface, *range, o.tiles);
  if (!tiles) return std::unexpected(tiles.error());
  ShardPlan plan;
  plan.source = std::move(source);
  plan.record = record_of(surface, *tiles, blocks, o);
  plan.blocks = blocks.encode();
  proto::LayerJson layer = tiles->layer(layer_name(surface));
  layer.version = tile_version(surface, *tiles, blocks.digest());
  plan.layer_text = proto::encode_layer_json(layer);
  plan.level = *level;
  std::vector<TileId> roots;
  const TileArea& area = tiles->tiles(*level);
  roots.reserve(area.size());
  for (std::uint64_t i = 0; i < area.size(); ++i)
    roots.push_back({*level, area[i].first, area[i].second});
  std::ranges::sort(roots, {}, curve_number);
  std::vector<ShardPlan::Shard> subtrees(roots.size());
  parallel_for(roots.size(), o.threads, [&](std::size_t i) {
    const std::uint64_t count = tiles_below(*tiles, roots[i]);
    subtrees[i] = {1, count, count * (kVoidTile + places_with_posts(surface, blocks, roots[i]))};
  });
  cut(plan, subtrees, *shards);
  for (int z = tiles->first_level(); z < *level; ++z) plan.top_tiles += tiles->tiles(z).size();
  if (plan.tiles() != tiles->tile_count())
    return fail(Errc::internal, "the shards do not have all tiles");
  progress.at(1);
  return plan;
}

Result<TilePlan> planned_tiles(const Surface& surface, const ShardPlan& plan) {
  const BuildRecord& r = plan.record;
  const auto other = [&](const std::string& what) {
    return fail(Errc::invalid_argument, surface.info().files.front() +
                                            " is not what was planned: " + what +
                                            "; plan again, or name what was planned");
  };
  if (grid_digest(surface) != r.grid)
    return other("its posts lie elsewhere, or their heights mean something else");
  const auto options = tile_options_of(r);
  if (!options) return std::unexpected(options.error());
  HeightRange range{r.range_m.first, r.range_m.second, 1};
  range.of_levels = r.level_ranges_m;
  auto tiles = TilePlan::make(surface, range, *options);
  if (!tiles) return tiles;
  const auto blocks = SurfaceBlocks::decode(plan.blocks, surface, r.heights);
  if (!blocks) return other("its blocks of posts are others");
  BuildOptions o;
  o.tiles = *options, o.gzip = r.gzip;
  const BuildRecord now = record_of(surface, *tiles, *blocks, o);
  if (now.epoch != r.epoch || now.layer_epoch != r.layer_epoch)
    return fail(Errc::invalid_argument,
                "the plan is of another version of tind, which made other bytes: plan again, or "
                "use that version");
  if (now.shapes != r.shapes || now.shape_levels != r.shape_levels)
    return fail(Errc::invalid_argument,
                "the lines or the water are not those planned: plan again, or name what was "
                "planned");
  if (encode(now) != encode(r))
    return other("it makes other tiles (its files may be others, or in another order)");
  return tiles;
}

std::vector<TileId> residual_tiles(const Surface& surface, const TilePlan& plan,
                                   const ShardTiles& tiles, std::size_t shard) {
  std::vector<TileId> mine;
  if (plan.index_depth().level() < 0 || shard == ShardTiles::kTop) return mine;
  std::map<TileId, std::size_t> owners;  // at `level`
  int level = -1;
  std::size_t dealt = 0;
  for (const TileId id : scanned_tiles(surface, plan.index_depth())) {
    if (id.level != level) level = id.level, owners = tiles.first_shards(level);
    const auto owner = owners.find(id);
    if ((owner != owners.end() ? owner->second : dealt++ % tiles.shards()) == shard)
      mine.push_back(id);
  }
  return mine;
}

namespace {

/// Of one layer: which blocks a shard depends on.
class Footprint {
 public:
  explicit Footprint(const SourceBlocks& blocks)
      : blocks_(blocks), marked_(std::size_t(blocks.across() * blocks.down())) {}

  void mark_all() { marked_.assign(marked_.size(), true); }
  /// The window, and as many posts around; columns that wrap come in on the other side.
  void mark(const PostWindow& w, std::int64_t around) {
    if (w.empty()) return;
    const std::int64_t side = blocks_.side(), more = 1 + around / side;
    const auto block = [&](std::int64_t post) {
      return std::int64_t(std::floor(double(post) / double(side)));
    };
    const std::int64_t first = std::max<std::int64_t>(0, block(w.row) - more),
                       last = std::min(blocks_.down() - 1, block(w.row + w.rows - 1) + more);
    for (std::int64_t j = first; j <= last; ++j)
      for (std::int64_t i = block(w.col) - more; i <= block(w.col + w.cols - 1) + more; ++i) {
        const std::int64_t at = (i % blocks_.across() + blocks_.across()) % blocks_.across();
        marked_[std::size_t(j * blocks_.across() + at)] = true;
      }
  }
  /// Marked blocks of one row, next to each other, of a few thousand posts at most.
  struct Run {
    std::int64_t row = 0, first = 0, count = 0;
  };
  std::vector<Run> runs() const {
    const std::int64_t most = std::max(1, 4096 / blocks_.side());
    std::vector<Run> out;
    for (std::int64_t j = 0; j < blocks_.down(); ++j)
      for (std::int64_t i = 0; i < blocks_.across(); ++i) {
        if (!marked_[std::size_t(j * blocks_.across() + i)]) continue;
        const bool goes_on = !out.empty() && out.back().row == j &&
                             out.back().first + out.back().count == i && out.back().count < most;
        if (goes_on)
          ++out.back().count;
        else
          out.push_back({j, i, 1});
      }
    return out;
  }

 private:
  const SourceBlocks& blocks_;
  std::vector<bool> marked_;
};

std::string name_of(const DemSource& source) {
  const auto& files = source.info().files;
  if (files.size() == 1) return files.front();
  return "one of " + files.front() + " and " + std::to_string(files.size() - 1) + " more files";
}

/// Nothing where the blocks of a run are as they were.
std::optional<Error> wrong_in(const DemSource& source, const SourceBlocks& planned,
                              const Footprint::Run& run, SourceBlocks& now) {
  const std::int64_t side = planned.side();
  const std::int64_t col = run.first * side, row = run.row * side;
  const auto grid = source.read(col, row, int(std::min(run.count * side, planned.cols() - col)),
                                int(std::min(side, planned.rows() - row)));
  if (!grid) return grid.error();
  now.add(col, row, *grid);
  for (std::int64_t i = run.first; i < run.first + run.count; ++i)
    if (now.differs(i, run.row, planned))
      return Error{Errc::invalid_argument,
                   name_of(source) + " changed since the plan was made, e.g. near column " +
                       std::to_string(i * side) + ", row " + std::to_string(row) +
                       (source.info().files.size() > 1 ? " of all together" : "") + ": plan again"};
  return {};
}

/// Where the tiles of a subtree look for heights: steps are those of tiles beside, too.
GeoRect looked_at(const TilePlan& pyramid, TileId root) {
  GeoRect r = tiling::rect(root);
  for (int z = root.level; pyramid.local_steps() && z <= pyramid.max_level(); ++z) {
    if (pyramid.knows_range() && pyramid.step_of_all(z) == pyramid.level(z).border_step_m) continue;
    const double beside = tiling::tile_degrees(z);
    return {r.west - beside, std::max(-90.0, r.south - beside), r.east + beside,
            std::min(90.0, r.north + beside)};
  }
  return r;
}

/// And how many posts farther: what fills voids, on which other fills rest, and normals.
std::int64_t posts_around(const Surface& surface, const DemSource& source, const TilePlan& pyramid,
                          TileId root) {
  constexpr double kDegree_m = 111320;
  const DemInfo& info = source.info();
  const double finest_m = std::min(info.spacing_x_m, info.spacing_y_m);
  const double normals_m = pyramid.level(root.level).normal_reach_deg * kDegree_m;
  return 2 * (VoidFill::kReach + 2) +
         std::int64_t(std::ceil((normals_m + bent_m(surface)) / finest_m));
}

}  // namespace

Result<void> check_planned_posts(const Surface& surface, const TilePlan& pyramid,
                                 const ShardPlan& plan, const ShardTiles& tiles, std::size_t shard,
                                 int threads, const Progress& progress,
                                 const std::vector<TileId>& more) {
  const auto planned = SurfaceBlocks::decode(plan.blocks, surface, plan.record.heights);
  if (!planned) return std::unexpected(planned.error());
  SurfaceBlocks now(surface);
  auto roots = tiles.roots(shard);
  roots.insert(roots.end(), more.begin(), more.end());
  for (std::size_t k = 0; k < surface.layers().size(); ++k) {
    const DemSource& source = *surface.layers()[k].source;
    const SourceBlocks& blocks = planned->layers()[k];
    Footprint footprint(blocks);
    if (shard == ShardTiles::kTop) footprint.mark_all();
    for (const TileId root : roots)
      if (surface.reaches(k, tiling::rect(root)))
        for (const PostWindow& posts : post_windows(source, looked_at(pyramid, root)))
          footprint.mark(posts, posts_around(surface, source, pyramid, root));
    const auto runs = footprint.runs();
    std::mutex mutex;
    std::optional<std::pair<std::size_t, Error>> first;
    std::size_t done = 0;
    parallel_for(runs.size(), threads, [&](std::size_t i) {
      if (progress.stopped()) return;
      auto wrong = wrong_in(source, blocks, runs[i], now.layers()[k]);
      const std::lock_guard lock(mutex);
      if (wrong && (!first || i < first->first)) first.emplace(i, std::move(*wrong));
      if (++done % std::max<std::size_t>(1, runs.size() / 100) == 0)
        progress.at((double(k) + double(done) / double(runs.size())) /
                    double(surface.layers().size()));
    });
    if (first) return std::unexpected(first->second);
    if (progress.stopped()) return fail(Errc::cancelled, "stopped while reading heights");
  }
  return {};
}

}  // namespace tind
