// Tiles come out of order, and are written in theirs: those that are ahead wait. Then the pack is
// written under a name of this process alone, given its own, and vouched for.

#include "terrain/pyramid/shards/make_shard.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "terrain/base/errno_text.h"
#include "terrain/base/file_io.h"
#include "terrain/base/file_there.h"
#include "terrain/base/parallel.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/make/make_tile.h"
#include "terrain/pyramid/plan/plan_source.h"
#include "terrain/pyramid/residual/residual_index.h"
#include "terrain/pyramid/shards/plan_shards.h"
#include "terrain/pyramid/shards/shard_spool.h"
#include "terrain/store/open/open_store.h"

namespace tind {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kChecking = 0.05;                  // the share of the work, more or less
constexpr auto kSynced = std::chrono::seconds(10);  // no more than that is lost without power

ArchiveHead head_of(const ShardPlan& plan, const ShardTiles& tiles, std::size_t shard) {
  proto::LayerJson layer = tiles.layer_of(shard);
  std::string text = proto::encode_layer_json(layer);
  return {.layer = std::move(layer),
          .layer_text = std::move(text),
          .record_text = encode(plan.record),
          .blocks = {}};
}

/// Tiles that are made, one after the other into the spool.
class Sink {
 public:
  explicit Sink(ShardSpool& spool) : spool_(spool), synced_(Clock::now()) {}

  /// How many are in the spool now.
  Result<std::size_t> take(std::size_t k, std::vector<std::uint8_t> packed, TileFacts facts) {
    const std::lock_guard lock(mutex_);
    waiting_.emplace(k, std::pair{std::move(packed), facts});
    for (auto it = waiting_.begin(); it != waiting_.end() && it->first == spool_.size();
         it = waiting_.erase(it))
      if (auto done = spool_.append(it->second.first, it->second.second); !done)
        return std::unexpected(done.error());
    if (Clock::now() - synced_ > kSynced) {
      if (auto done = spool_.sync(); !done) return std::unexpected(done.error());
      synced_ = Clock::now();
    }
    return spool_.size();
  }

 private:
  ShardSpool& spool_;
  std::mutex mutex_;
  std::map<std::size_t, std::pair<std::vector<std::uint8_t>, TileFacts>> waiting_;
  Clock::time_point synced_;
};

Result<void> make_tiles(const Surface& surface, const TilePlan& plan, std::span<const TileId> ids,
                        ShardSpool& spool, Heartbeat& heart, const ShardOptions& o,
                        const Progress& progress) {
  const std::size_t begin = spool.size();
  Sink sink(spool);
  std::mutex mutex;
  std::optional<Error> error;
  std::atomic<bool> give_up = false;
  std::atomic<std::size_t> done = begin;
  parallel_for(ids.size() - begin, o.threads, [&](std::size_t i) {
    if (give_up || progress.stopped()) return;
    const std::size_t k = begin + i;
    auto tile = make_tile(surface, plan, ids[k], o.abandon);
    Result<std::size_t> taken = 0;
    if (tile) {
      const TileFacts facts{.size = 0,
                            .max_error_m = tile->max_error_m,
                            .edge_error_m = tile->edge_error_m,
                            .not_one_sided = tile->side != plan.options().side};
      taken = sink.take(k, gzipped(tile->bytes), facts);
    }
    if (!tile || !taken) {
      const std::lock_guard lock(mutex);
      if (!error) error = tile ? taken.error() : tile.error();
      give_up = true;
      return;
    }
    heart.made(*taken);
    if (const std::size_t n = ++done; n % std::max<std::size_t>(1, ids.size() / 500) == 0)
      progress.at(double(n) / double(ids.size()));
  });
  if (!error && !progress.stopped()) return {};  // the pack comes next
  (void)spool.sync();                            // what is made is not lost, however it ended
  if (!error || (progress.stopped() && error->code == Errc::cancelled))
    return fail(Errc::cancelled, "stopped after " + std::to_string(spool.size()) + " of " +
                                     std::to_string(ids.size()) +
                                     " tiles; run the same command to go on");
  return std::unexpected(*error);
}

ShardRecord record_of(const ShardPlan& plan, std::size_t shard, std::span<const TileId> ids,
                      const ShardSpool& spool) {
  ShardRecord r;
  r.plan = plan.hash(), r.shard = shard_name(shard), r.tiles = ids.size();
  for (std::size_t k = 0; k < ids.size(); ++k) {
    if (r.levels.empty() || r.levels.back().level != ids[k].level)
      r.levels.push_back({.level = ids[k].level});
    ShardRecord::Level& level = r.levels.back();
    const TileFacts& facts = spool.facts(k);
    ++level.tiles, level.bytes += facts.size;
    level.worst_error_m = std::max(level.worst_error_m, facts.max_error_m);
    level.worst_edge_error_m = std::max(level.worst_edge_error_m, facts.edge_error_m);
    r.not_one_sided += facts.not_one_sided;
  }
  return r;
}

/// Its name is for good. Where it cannot be given, nothing is left.
Result<void> give_name(const std::string& from, const std::string& to) {
  const auto failed = [&] {
    return fail(Errc::io, "cannot put into place " + to + ": " + errno_text(errno));
  };
  if (::rename(from.c_str(), to.c_str()) != 0) {
    const auto error = failed();
    ::unlink(from.c_str());
    return error;
  }
  const int folder = ::open(fs::path(to).parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return failed();
  const bool synced = ::fsync(folder) == 0 || errno == EINVAL;
  ::close(folder);
  return synced ? Result<void>{} : failed();
}

Result<void> write_pack(const std::string& own, const std::string& name, ArchiveHead head,
                        std::span<const TileId> ids, const ShardSpool& spool) {
  auto writer = write_archive_store(own, std::move(head));
  if (!writer) return std::unexpected(writer.error());
  for (std::size_t k = 0; k < ids.size(); ++k) {
    const auto bytes = spool.read(k);
    if (!bytes) return std::unexpected(bytes.error());
    if (auto done = (*writer)->add(ids[k], *bytes, spool.facts(k)); !done) return done;
  }
  if (auto done = (*writer)->finish(); !done) return done;
  return give_name(own, name);
}

/// What a record says of a file.
Result<void> vouch(const std::string& file, std::uint64_t& bytes, std::string& sha256) {
  const auto sum = sha256_of_file(file);
  if (!sum) return std::unexpected(sum.error());
  std::error_code error;
  bytes = fs::file_size(file, error), sha256 = *sum;
  if (error) return fail(Errc::io, "cannot look into " + file + ": " + error.message());
  return {};
}

/// What the shards that have a record made of the residual index.
std::vector<IndexPart> parts_of(const ShardPlan& plan, const ShardFolder& folder) {
  const std::string hash = plan.hash();
  std::vector<IndexPart> parts;
  for (std::size_t i = 0; i < plan.shards.size(); ++i) {
    const auto text = read_regular_file(folder.record(i));
    if (!text) continue;
    const auto record = decode_shard_record(*text);
    if (record && record->plan == hash && record->residual_bytes > 0)
      parts.push_back({folder.residuals(i), hash});
  }
  return parts;
}

Result<ShardReport> make(const Surface& surface, const ShardPlan& plan, const ShardTiles& tiles,
                         std::size_t shard, const ShardFolder& folder, const ShardOptions& o,
                         const Progress& progress) {
  auto pyramid = planned_tiles(surface, plan);
  if (!pyramid) return std::unexpected(pyramid.error());
  const auto ids = tiles.in_order(shard);
  Heartbeat heart(folder.beat(shard), ids.size(), o.heartbeat_s);
  const bool indexed = shard == ShardTiles::kTop && pyramid->index_depth().level() >= 0;
  const auto residuals = residual_tiles(surface, *pyramid, tiles, shard);
  const double reading = indexed ? 0.8 : residuals.empty() ? kChecking : 0.2;
  if (auto same = check_planned_posts(surface, *pyramid, plan, tiles, shard, o.threads,
                                      progress.part(0, kChecking), residuals);
      !same)
    return std::unexpected(same.error());
  const Progress looking = progress.part(kChecking, reading);
  if (indexed) {  // tiles of the shards are deeper than it goes
    const auto parts = parts_of(plan, folder);
    auto index =
        index_for(surface, *pyramid, folder.path() + "/residuals", o.threads, looking, parts);
    if (!index) return std::unexpected(index.error());
    pyramid->use(std::move(*index));
  }
  if (!residuals.empty())
    if (auto made =
            make_index_part({folder.residuals(shard), plan.hash()}, folder.own_residuals(shard),
                            surface, pyramid->index_depth(), residuals, o.threads, looking);
        !made)
      return std::unexpected(made.error());
  ArchiveHead head = head_of(plan, tiles, shard);
  auto spool = ShardSpool::open(folder.tiles(shard), head.seed(), ids);
  if (!spool) return std::unexpected(spool.error());
  ShardReport report;
  report.tiles = ids.size(), report.kept = spool->size();
  report.made = report.tiles - report.kept;
  heart.made(spool->size());
  if (auto made = make_tiles(surface, *pyramid, ids, *spool, heart, o, progress.part(reading, 1));
      !made)
    return std::unexpected(made.error());
  ShardRecord record = record_of(plan, shard, ids, *spool);
  if (!residuals.empty())
    if (auto done = vouch(folder.residuals(shard), record.residual_bytes, record.residual_sha256);
        !done)
      return std::unexpected(done.error());
  const std::string pack = folder.pack(shard);
  if (auto done = write_pack(folder.own_pack(shard), pack, std::move(head), ids, *spool); !done)
    return std::unexpected(done.error());
  if (auto done = vouch(pack, record.bytes, record.sha256); !done)
    return std::unexpected(done.error());
  if (auto done = write_whole_file(folder.record(shard), encode(record)); !done)
    return std::unexpected(done.error());
  spool->remove();
  report.bytes = record.bytes, report.sha256 = record.sha256;
  progress.at(1);
  return report;
}

}  // namespace

Result<ShardReport> make_shard(const Surface& surface, const ShardPlan& plan, std::size_t shard,
                               const ShardOptions& o, const Progress& progress) {
  const auto tiles = ShardTiles::of(plan);
  if (!tiles) return std::unexpected(tiles.error());
  if (shard != ShardTiles::kTop && shard >= plan.shards.size())
    return fail(Errc::invalid_argument, "there is no shard " + std::to_string(shard) + " of " +
                                            std::to_string(plan.shards.size()));
  const ShardFolder folder(o.folder);
  const std::string hash = plan.hash();
  if (auto ours = belongs_to(folder, hash); !ours) return std::unexpected(ours.error());
  std::error_code error;
  fs::create_directories(folder.path(), error);
  if (error) return fail(Errc::io, "cannot create " + folder.path() + ": " + error.message());
  const ShardStatus there = judge_shard(plan, hash, folder, shard, true);
  if (there.state == ShardState::done) {
    ShardReport report;
    report.tiles = report.kept = there.tiles, report.there = true;
    if (const auto text = read_regular_file(folder.record(shard)))
      if (const auto record = decode_shard_record(*text))
        report.bytes = record->bytes, report.sha256 = record->sha256;
    ::unlink(folder.tiles(shard).c_str());  // of a second run that was stopped
    return report;
  }
  const auto said_whose = is_there(folder.plan());
  if (!said_whose) return std::unexpected(said_whose.error());
  if (!*said_whose)
    if (auto said = write_whole_file(folder.plan(), hash + "\n"); !said)
      return std::unexpected(said.error());
  ::unlink(folder.error(shard).c_str());
  // No word of a pack that is not there, or is not as it says.
  if (there.state == ShardState::failed) ::unlink(folder.record(shard).c_str());
  auto made = make(surface, plan, *tiles, shard, folder, o, progress);
  if (!made && made.error().code != Errc::cancelled) leave_error(folder, shard, made.error());
  return made;
}

}  // namespace tind
