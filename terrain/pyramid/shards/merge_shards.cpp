#include "terrain/pyramid/shards/merge_shards.h"

#include <algorithm>
#include <atomic>
#include <list>
#include <map>
#include <mutex>
#include <utility>

#include "terrain/base/file_there.h"
#include "terrain/base/parallel.h"
#include "terrain/store/copy/copy_store.h"
#include "terrain/store/open/open_store.h"

namespace tind {

namespace {

constexpr std::size_t kOpenPacks = 64;
constexpr std::size_t kNamed = 20;

class MergedShards : public TileStore {
 public:
  MergedShards(const ShardPlan& plan, ShardTiles tiles, ShardFolder folder)
      : plan_(plan), tiles_(std::move(tiles)), folder_(std::move(folder)) {}

  std::string name() const override { return folder_.path(); }
  std::string layer_name() const override { return "the plan's layer.json"; }
  std::string tile_name(TileId id) const override {
    return folder_.pack(tiles_.shard_of(id)) + ", tile " + id.text();
  }
  bool remote() const override { return false; }
  Result<std::vector<std::uint8_t>> layer_json() const override {
    return std::vector<std::uint8_t>(plan_.layer_text.begin(), plan_.layer_text.end());
  }
  Result<std::optional<BuildRecord>> record() const override { return plan_.record; }
  Result<std::string> kept_blocks() const override { return plan_.blocks; }
  Result<std::vector<std::uint8_t>> read(TileId id) const override { return pack_of(id)->read(id); }
  Result<StoredTile> look_at(TileId id) const override { return pack_of(id)->look_at(id); }

 private:
  using Pack = std::shared_ptr<const TileStore>;
  Pack pack_of(TileId id) const {
    const std::size_t shard = tiles_.shard_of(id);
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find(open_, shard, &std::pair<std::size_t, Pack>::first);
    if (found != open_.end())
      open_.splice(open_.begin(), open_, found);
    else
      open_.emplace_front(shard, Pack(open_store(folder_.pack(shard))));
    if (open_.size() > kOpenPacks) open_.pop_back();
    return open_.front().second;
  }

  const ShardPlan& plan_;
  const ShardTiles tiles_;
  const ShardFolder folder_;
  mutable std::mutex mutex_;
  mutable std::list<std::pair<std::size_t, Pack>> open_;  // the last that was asked for first
};

std::string names_of(const std::vector<std::size_t>& shards) {
  std::string text;
  for (std::size_t k = 0; k < std::min(kNamed, shards.size()); ++k)
    text += (k > 0 ? ", " : "") + std::to_string(shards[k]);
  return text + (shards.size() > kNamed ? ", ..." : "");
}

/// All are there and whole.
Result<void> check_shards(const ShardPlan& plan, const ShardFolder& folder, int threads,
                          const Progress& progress) {
  const std::string hash = plan.hash();
  if (auto ours = belongs_to(folder, hash); !ours) return ours;
  std::vector<ShardStatus> found(plan.shards.size());
  std::atomic<std::size_t> done = 0;
  parallel_for(found.size(), threads, [&](std::size_t i) {
    if (progress.stopped()) return;
    found[i] = judge_shard(plan, hash, folder, i, true);
    progress.at(double(++done) / double(found.size()));
  });
  if (progress.stopped()) return fail(Errc::cancelled, "stopped; run the same command again");
  std::vector<std::size_t> missing, broken;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i].state == ShardState::missing) missing.push_back(i);
    if (found[i].state != ShardState::failed) continue;
    if (found[i].unread)
      return fail(Errc::io, found[i].what + "; where it stays so, make shard " + std::to_string(i) +
                                " again (tind build --plan)");
    const auto record = is_there(folder.record(i));
    if (!record) return std::unexpected(record.error());
    // Without one its run ended with an error: it is not there, rather than wrong.
    (*record ? broken : missing).push_back(i);
  }
  if (!broken.empty())
    return fail(Errc::bad_data,
                found[broken.front()].what + "; " + std::to_string(broken.size()) + " of " +
                    std::to_string(found.size()) +
                    " shards are to be made again (tind build --plan makes what is not as it "
                    "should be): " +
                    names_of(broken) +
                    (missing.empty() ? ""
                                     : "; " + std::to_string(missing.size()) +
                                           " are not there: " + names_of(missing)));
  if (!missing.empty())
    return fail(Errc::busy, std::to_string(missing.size()) + " of " + std::to_string(found.size()) +
                                " shards are not there: " + names_of(missing) +
                                "; make them, then merge again");
  return {};
}

}  // namespace

Result<std::unique_ptr<TileStore>> merged_store(const ShardPlan& plan, const std::string& folder) {
  auto tiles = ShardTiles::of(plan);
  if (!tiles) return std::unexpected(tiles.error());
  return std::make_unique<MergedShards>(plan, std::move(*tiles), ShardFolder(folder));
}

Result<bool> is_merged(const ShardPlan& plan, const std::string& output) {
  const auto store = open_store(output);
  const auto layer = store->layer_json();
  if (!layer && layer.error().code == Errc::io) return std::unexpected(layer.error());
  const auto record = store->record();
  if (!record) return std::unexpected(record.error());
  if (!layer || !*record || encode(**record) != encode(plan.record) ||
      !std::ranges::equal(*layer, plan.layer_text,
                          [](std::uint8_t a, char b) { return a == std::uint8_t(b); }))
    return false;
  const auto there = store->list();
  if (!there) return std::unexpected(there.error());
  const auto& listed = *there;
  if (!listed) return true;
  std::uint64_t tiles = 0;
  for (const auto& level : listed->levels) tiles += level.size();
  return tiles >= plan.tiles();
}

Result<MergeReport> merge_shards(const ShardPlan& plan,
                                 const std::function<Result<Surface>()>& open,
                                 const MergeOptions& o, const Progress& progress) {
  const ShardFolder folder(o.shards.folder);
  if (auto whole = check_shards(plan, folder, o.shards.threads, progress.part(0, 0.2)); !whole)
    return std::unexpected(whole.error());
  MergeReport report;
  if (judge_shard(plan, plan.hash(), folder, ShardTiles::kTop, true).state != ShardState::done) {
    const auto surface = open();
    if (!surface) return std::unexpected(surface.error());
    const auto top =
        make_shard(*surface, plan, ShardTiles::kTop, o.shards, progress.part(0.2, 0.6));
    if (!top) return std::unexpected(top.error());
    report.top_made = top->made;
  }
  const auto store = merged_store(plan, o.shards.folder);
  if (!store) return std::unexpected(store.error());
  const auto copied =
      copy_store(**store, o.output, {.force = o.force, .threads = o.shards.threads, .packed = true},
                 progress.part(0.6, 1));
  if (!copied) return std::unexpected(copied.error());
  remove_leftovers(folder);
  report.tiles = copied->tiles, report.kept = copied->kept, report.bytes = copied->bytes;
  return report;
}

}  // namespace tind
