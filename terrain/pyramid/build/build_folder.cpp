// The record names the blocks' file by its digest, and the ledger by its own. An update has all
// three in its own folder, with the tiles. There is one moment at which it counts, the renaming of
// that folder: before it, the old record says what the directory holds; after it, every run moves
// what is left of it first.
//
// What survives a power cut is only what was synced. So: tiles are renamed into place; then, a
// batch at a time, the file system is synced; only then the ledger says that they are there, and is
// synced itself. A tile that the ledger does not name is made again, whatever lies in its place;
// one that it names is read and compared.

#include "terrain/pyramid/build/build_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "proto/file_io.h"
#include "terrain/base/parallel.h"
#include "terrain/pyramid/plan/dirty_tiles.h"
#include "terrain/pyramid/plan/tile_version.h"
#include "terrain/store/folder_aside.h"
#include "terrain/store/folder_contents.h"

namespace tind {

namespace fs = std::filesystem;
using namespace folder;

namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 3;  // of the record; from 3 on there is a ledger
constexpr std::chrono::seconds kLongestPending{4};

/// Everything that the tiles depend on.
Json record_of(const DemSource& source, const TilePlan& plan, const SourceBlocks& blocks,
               const BuildOptions& o) {
  Json j;
  j["made_by"] = "tind build";
  j["format"] = kFormat;
  j["epoch"] = kTileEpoch;
  j["grid"] = grid_digest(source.info());
  j["heights"] = blocks.digest();
  j["max_error_m"] = o.tiles.max_error_m;
  j["error_factor"] = o.tiles.error_factor;
  j["deepest_level"] = plan.max_level();
  j["levels"] = {plan.first_level(), plan.last_level()};
  j["side"] = o.tiles.side;
  j["vertical_datum"] = name(source.info().datum);  // for people; the grid has it, too
  j["effort"] = o.tiles.effort;
  j["gzip"] = o.gzip;
  if (o.tiles.exact_posts > 0) j["exact_posts"] = o.tiles.exact_posts;
  if (const std::string tiles = area_digest(plan); !tiles.empty()) j["tiles"] = tiles;
  // By level: a source with a larger range of heights can need coarser steps.
  for (int z = 0; z <= plan.max_level(); ++z) j["steps_m"].push_back(plan.level(z).border_step_m);
  return j;
}

std::string text_of(const Json& record) { return record.dump(1) + "\n"; }

/// The blocks of the content that the tiles here were made of.
Result<SourceBlocks> old_blocks(const Json& record, const DemInfo& info, const BuildOptions& o) {
  const Json heights = record.value("heights", Json());
  const std::string digest = heights.is_string() ? std::string(heights) : "";
  const std::string path = o.output + kBlocks + digest;
  const auto bytes = proto::read_whole_file(path);
  if (!bytes) return fail(Errc::io, bytes.error());
  auto blocks = SourceBlocks::decode(*bytes, info, digest);
  if (!blocks) return fail(path, blocks.error());
  return blocks;
}

/// Which tiles depend on heights that changed.
std::vector<std::uint8_t> tiles_of_changes(const DemSource& source, const TilePlan& plan,
                                           const TileOrder& ids, const SourceBlocks& before,
                                           const SourceBlocks& after, const Json& old_steps,
                                           UpdateReport& report) {
  report.updated = true;
  report.blocks = after.size();
  report.block_posts = after.side();
  for (const std::uint8_t differs : after.difference(before)) report.changed_blocks += differs;
  std::vector<std::uint8_t> dirty = dirty_tiles(source, plan, ids, before, after);
  std::vector<bool> other_steps;
  for (int z = 0; z <= plan.max_level(); ++z) {
    const bool same = std::size_t(z) < old_steps.size() &&
                      old_steps[std::size_t(z)] == plan.level(z).border_step_m;
    other_steps.push_back(!same);
    report.levels_of_other_steps += !same;
  }
  for (std::size_t k = 0; k < ids.size(); ++k) {
    // A tile that stands in for missing children has vertices of the next level.
    const auto z = std::size_t(ids[k].level);
    dirty[k] = dirty[k] || other_steps[z] || (z + 1 < other_steps.size() && other_steps[z + 1]);
    report.dirty_tiles += dirty[k];
  }
  return dirty;
}

/// Why tiles made as `found` says are not those that are wanted.
std::string difference(const Json& found, const Json& wanted) {
  if (!is_record(found)) return "a damaged record of a build";
  if (found.value("format", Json()) != wanted["format"])
    return "tiles of a version of tind that kept no ledger of them";
  if (found.value("epoch", Json()) != wanted["epoch"]) {
    return "tiles of another version of tind, which makes other bytes of the same posts (epoch " +
           found.value("epoch", Json()).dump() + ", not " + wanted["epoch"].dump() + ")";
  }
  if (found.value("grid", Json()) != wanted["grid"]) return "tiles of another source";
  return "tiles of other options";
}

std::unexpected<Error> refused(const std::string& folder, const std::string& why,
                               const std::string& what_to_do) {
  return fail(Errc::invalid_argument, folder + " holds " + why + ": " + what_to_do);
}

/// A ledger of this folder that says what it says of the tiles of this record.
std::optional<TileLedger> ledger_in(const std::string& folder, const std::string& record) {
  auto ledger = TileLedger::open(folder + kLedger);
  if (!ledger || !ledger->belongs_to(record)) return {};
  return std::move(*ledger);
}

}  // namespace

Result<std::unique_ptr<BuildFolder>> BuildFolder::claim(FolderFiles& files, FolderLock lock,
                                                        const DemSource& source,
                                                        const TilePlan& plan, const TileOrder& ids,
                                                        const SourceBlocks& blocks,
                                                        const BuildOptions& o,
                                                        const Progress& progress) {
  std::unique_ptr<BuildFolder> folder(new BuildFolder(files, std::move(lock), ids, o));
  const std::string path = o.output + kRecord;
  const bool began = folder->lock_.left_behind() || type_of(path) == fs::file_type::regular;
  if (auto ok = check_partial(o.output, began); !ok) return std::unexpected(ok.error());
  if (auto ok = look_aside(o.output, kAside); !ok) return std::unexpected(ok.error());
  if (auto done = adopt(files, o.output); !done) return std::unexpected(done.error());
  const Json wanted = record_of(source, plan, blocks, o);
  const std::string wanted_text = text_of(wanted);
  const auto all = [](TileId) { return true; };
  if (!fs::exists(fs::symlink_status(path))) {
    if (fs::exists(fs::symlink_status(o.output + kLayer)))
      return refused(o.output, "a tile set that tind build did not make",
                     "choose another directory");
    const auto none = [](TileId) { return false; };
    if (auto ok = check_way(o.output, ids, false, none); !ok) return std::unexpected(ok.error());
    if (auto ok = check_blocks(o.output, blocks.digest(), false); !ok)
      return std::unexpected(ok.error());
    if (auto done = folder->start(wanted_text, blocks, plan); !done)
      return std::unexpected(done.error());
    return folder;
  }
  const auto text = proto::read_whole_file(path);
  if (!text) return fail(Errc::io, text.error());
  const Json found = Json::parse(*text, nullptr, false);
  const bool update = is_record(found) && found != wanted && same_but_heights(found, wanted);
  if (found == wanted || update) {
    if (auto ok = check_way(o.output, ids, true, all); !ok) return std::unexpected(ok.error());
    if (auto ok = check_blocks(o.output, blocks.digest(), !update); !ok)
      return std::unexpected(ok.error());
    if (auto done = remove_partial_files(files, o.output); !done)
      return std::unexpected(done.error());
    folder->ledger_ = ledger_in(o.output, *text);
  }
  if (found == wanted) {
    folder->claimed_ = true;
    // An update to content that has gone again.
    if (auto done = remove_aside(files, o.output, kAside); !done)
      return std::unexpected(done.error());
    auto done = folder->ledger_ ? folder->make_folders() : folder->start(wanted_text, blocks, plan);
    if (done) done = folder->mend_blocks(o.output, blocks);
    if (!done) return std::unexpected(done.error());
    folder->sound_ = folder->look_at_tiles(false, progress);
    if (progress.stopped()) return fail(Errc::cancelled, "stopped while looking at finished tiles");
    return folder;
  }
  std::string why = difference(found, wanted);
  if (update) {
    const auto before = old_blocks(found, source.info(), o);
    if (before) {
      const Json steps = found.value("steps_m", Json::array());
      folder->dirty_ = tiles_of_changes(source, plan, ids, *before, blocks, steps, folder->update_);
      if (auto done = folder->start_update(wanted_text, blocks, plan, progress); !done)
        return std::unexpected(done.error());
      if (progress.stopped())
        return fail(Errc::cancelled, "stopped while looking at finished tiles");
      return folder;
    }
    why = "tiles of other heights, and what changed cannot be told (" + before.error().what + ")";
  }
  why += " (see " + path + ")";
  if (!o.force)
    return refused(o.output, why, "choose another directory, or --force to replace them");
  const auto old = TileLedger::open(o.output + kLedger);
  if (!old) {
    return refused(o.output, why,
                   "without a whole ledger --force cannot tell which of them are "
                   "tind's to replace; choose another directory, or remove this one");
  }
  const auto named = [&](TileId id) { return old->names(id); };
  if (auto ok = check_way(o.output, ids, true, named); !ok) return std::unexpected(ok.error());
  const bool same_heights = is_record(found) && found.value("heights", Json()) == wanted["heights"];
  if (auto ok = check_blocks(o.output, blocks.digest(), same_heights); !ok)
    return std::unexpected(ok.error());
  // So that no old tile can be taken for one of ours.
  if (auto done = files.remove(o.output + kLayer); !done) return std::unexpected(done.error());
  if (auto done = files.sync_folder(o.output); !done) return std::unexpected(done.error());
  if (auto done = remove_tiles(files, o.output, *old); !done) return std::unexpected(done.error());
  if (auto done = remove_aside(files, o.output, kAside); !done)
    return std::unexpected(done.error());
  // A tile that comes back must not be met by a ledger that does not name it.
  if (auto done = files.sync_all(o.output); !done) return std::unexpected(done.error());
  if (auto done = folder->start(wanted_text, blocks, plan); !done)
    return std::unexpected(done.error());
  return folder;
}

BuildFolder::~BuildFolder() {
  // Else the next build does, and goes by the lock's file.
  if (claimed_ && !remove_partial_files(files_, output_)) lock_.leave_behind();
}

std::string BuildFolder::path(std::size_t k) const {
  return tile_path(is_aside(k) ? output_ + kAside : output_, ids_[k]);
}

/// Aside, synced, renamed, synced: what was there, or this, and from here on this.
Result<void> BuildFolder::put(const std::string& path, std::string_view bytes) {
  const std::string partial = partial_path(output_, next_partial_++);
  if (auto done = files_.make_folder(output_ + kPartial); !done) return done;
  if (auto done = files_.write(partial, bytes); !done) return done;
  if (auto done = files_.sync_file(partial); !done) return done;
  if (auto done = files_.rename(partial, path); !done) return done;
  return files_.sync_folder(fs::path(path).parent_path().string());
}

/// Blocks, an empty ledger and the record that needs both.
Result<void> BuildFolder::put_record(const std::string& folder, const std::string& record,
                                     const SourceBlocks& blocks, const TilePlan& plan,
                                     std::optional<TileLedger>& ledger) {
  const TileLedger::Levels levels = plan.layer("").available;
  if (auto done = put(folder + kBlocks + blocks.digest(), blocks.encode()); !done) return done;
  if (auto done = put(folder + kLedger, TileLedger::blank(record, levels)); !done) return done;
  if (auto done = put(folder + kRecord, record); !done) return done;
  auto opened = TileLedger::open(folder + kLedger);
  if (!opened) return std::unexpected(opened.error());
  ledger = std::move(*opened);
  return {};
}

/// The blocks' file is only read by the next update, which a damaged one would stop.
Result<void> BuildFolder::mend_blocks(const std::string& folder, const SourceBlocks& blocks) {
  const std::string path = folder + kBlocks + blocks.digest(), wanted = blocks.encode();
  if (const auto found = proto::read_whole_file(path); found && *found == wanted) return {};
  return put(path, wanted);
}

Result<void> BuildFolder::start(const std::string& record, const SourceBlocks& blocks,
                                const TilePlan& plan) {
  claimed_ = true;
  if (auto done = remove_partial_files(files_, output_); !done)
    return std::unexpected(done.error());
  if (auto done = put_record(output_, record, blocks, plan, ledger_); !done)
    return std::unexpected(done.error());
  if (auto done = remove_other_blocks(files_, output_, blocks.digest()); !done)
    return std::unexpected(done.error());
  return make_folders();
}

Result<void> BuildFolder::start_update(const std::string& record, const SourceBlocks& blocks,
                                       const TilePlan& plan, const Progress& progress) {
  std::vector<std::uint8_t> kept = look_at_tiles(false, progress.part(0, 0.5));
  for (std::size_t k = 0; k < kept.size(); ++k) dirty_[k] = dirty_[k] || !kept[k];
  const std::string aside = output_ + kAside;
  claimed_ = true;
  // What an earlier run to the same content left there.
  const auto text = proto::read_whole_file(aside + kRecord);
  if (text && *text == record) aside_ = ledger_in(aside, record);
  if (aside_) {
    if (auto done = mend_blocks(aside, blocks); !done) return done;
  } else {
    if (auto done = remove_aside(files_, output_, kAside); !done) return done;
    if (auto done = files_.make_folder(aside); !done) return done;
    if (auto done = put_record(aside, record, blocks, plan, aside_); !done) return done;
  }
  if (auto done = make_folders(); !done) return done;
  sound_ = look_at_tiles(true, progress.part(0.5, 1));
  for (std::size_t k = 0; k < kept.size(); ++k) sound_[k] = sound_[k] || kept[k];
  return {};
}

Result<void> BuildFolder::make_folders() {
  if (auto done = files_.make_folder(output_ + kPartial); !done) return done;
  std::set<std::string> made;
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    std::string folder = path(k);
    folder.resize(folder.find_last_of('/'));
    if (!made.insert(folder).second) continue;
    if (auto done = files_.make_folder(folder); !done) return done;
  }
  return {};
}

/// Reads tiles that are in their places, or those that are aside, and says which are as the ledger
/// has them.
std::vector<std::uint8_t> BuildFolder::look_at_tiles(bool aside, const Progress& progress) {
  std::vector<std::uint8_t> sound(ids_.size());
  const std::optional<TileLedger>& ledger = aside ? aside_ : ledger_;
  std::atomic<std::uint64_t> unsound = 0;
  std::atomic<std::size_t> done = 0;
  parallel_for(ids_.size(), options_.threads, [&](std::size_t k) {
    if (is_aside(k) != aside || progress.stopped()) return;
    const auto entry = ledger ? ledger->find(ids_[k]) : std::nullopt;
    if (entry) {
      const auto bytes = proto::read_whole_file(path(k));
      sound[k] = bytes && entry->vouches_for(*bytes);
    }
    std::error_code ignored;
    if (!sound[k] && (entry || fs::exists(path(k), ignored))) ++unsound;
    if (++done % std::max<std::size_t>(1, ids_.size() / 200) == 0)
      progress.at(double(done) / double(ids_.size()));
  });
  unsound_ += unsound;
  return sound;
}

std::optional<LedgerEntry> BuildFolder::finished(std::size_t k) const {
  if (sound_.empty() || !sound_[k]) return {};
  return (is_aside(k) ? aside_ : ledger_)->find(ids_[k]);
}

Result<void> BuildFolder::write(std::size_t k, std::string_view bytes, LedgerEntry known) {
  const std::string partial = partial_path(output_, next_partial_++);
  if (auto done = files_.write(partial, bytes); !done) return done;
  if (auto done = files_.rename(partial, path(k)); !done) return done;
  known.id = ids_[k];
  known.take(bytes);
  {
    const std::lock_guard lock(mutex_);
    pending_.push_back(known);
    if (pending_.size() < std::size_t(options_.batch) &&
        std::chrono::steady_clock::now() - last_commit_ < kLongestPending)
      return {};
    if (committing_) return {};  // another thread is at it
  }
  return commit();
}

Result<void> BuildFolder::commit() {
  std::vector<LedgerEntry> entries;
  {
    const std::lock_guard lock(mutex_);
    if (committing_ || pending_.empty()) return {};
    committing_ = true;
    entries.swap(pending_);
  }
  auto done = files_.sync_all(output_);
  if (done) done = enter(std::move(entries));
  const std::lock_guard lock(mutex_);
  committing_ = false;
  last_commit_ = std::chrono::steady_clock::now();
  return done;
}

/// Entries of tiles that are durable, into the ledger of what this build makes.
Result<void> BuildFolder::enter(std::vector<LedgerEntry> entries) {
  const TileLedger& ledger = aside_ ? *aside_ : *ledger_;
  const std::string path = output_ + (aside_ ? kAside : "") + kLedger;
  std::ranges::sort(entries, {}, [&](const LedgerEntry& e) { return ledger.offset(e.id); });
  std::string run;  // of places side by side
  std::uint64_t begin = 0;
  for (const LedgerEntry& e : entries) {
    const std::uint64_t at = ledger.offset(e.id);
    if (!run.empty() && begin + run.size() != at) {
      if (auto done = files_.write_at(path, begin, run); !done) return done;
      run.clear();
    }
    if (run.empty()) begin = at;
    run += ledger.encode(e);
  }
  if (auto done = files_.write_at(path, begin, run); !done) return done;
  return files_.sync_file(path);
}

Result<void> BuildFolder::finish(std::string_view layer_json) {
  if (auto done = commit(); !done) return done;
  if (!aside_) return put(output_ + kLayer, layer_json);
  // What stays is vouched for by the old ledger until now, and by the new one from now on.
  std::vector<LedgerEntry> kept;
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    if (!is_aside(k)) {
      const auto entry = ledger_->find(ids_[k]);
      if (!entry) return fail(Errc::io, output_ + kLedger + " was changed meanwhile");
      kept.push_back(*entry);
    }
    if (kept.size() < 4096 && k + 1 < ids_.size()) continue;
    if (kept.empty()) continue;
    if (auto done = enter(std::exchange(kept, {})); !done) return done;
  }
  if (auto done = put(output_ + kAside + kLayer, layer_json); !done) return done;
  if (auto done = files_.sync_all(output_); !done) return done;
  if (auto done = files_.rename(output_ + kAside, output_ + kReady); !done) return done;
  if (auto done = files_.sync_folder(output_); !done) return done;
  return adopt(files_, output_);
}

}  // namespace tind
