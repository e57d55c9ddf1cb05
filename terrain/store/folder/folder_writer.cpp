// The record names the blocks' file by its digest, and the ledger by its own. An update has all
// three in its own folder, with the tiles. There is one moment at which it counts, the renaming of
// that folder: before it, the old record says what the directory holds; after it, every run moves
// what is left of it first.
//
// What survives a power cut is only what was synced. So: tiles are renamed into place; then, a
// batch at a time, the file system is synced; only then the ledger says that they are there, and is
// synced itself. A tile that the ledger does not name is made again, whatever lies in its place;
// one that it names is read and compared.

#include "terrain/store/folder/folder_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "proto/json_text.h"
#include "terrain/base/file_io.h"
#include "terrain/base/parallel.h"
#include "terrain/store/folder/folder_aside.h"
#include "terrain/store/folder/folder_contents.h"
#include "terrain/store/folder/folder_lock.h"
#include "terrain/store/folder/folder_within.h"
#include "terrain/store/folder/product_records.h"
#include "terrain/store/folder/tile_ledger.h"
#include "terrain/store/taken_away.h"

namespace tind {

namespace fs = std::filesystem;
using namespace folder;

namespace {

using Json = nlohmann::ordered_json;

constexpr std::chrono::seconds kLongestPending{4};

/// Nothing where there is none, or none that can be made sense of.
Result<std::optional<proto::LayerJson>> layer_in(const std::string& folder) {
  const auto text = read_regular_file(folder + kLayer);
  if (!text && text.error().code != Errc::not_found) return std::unexpected(text.error());
  if (!text) return std::nullopt;
  auto layer = proto::decode_layer_json(*text);
  return layer ? std::optional(std::move(*layer)) : std::nullopt;
}

class FolderWriter : public TileWriter {
 public:
  static Result<std::unique_ptr<TileWriter>> claim(std::shared_ptr<FolderFiles>, FolderLock,
                                                   const std::string& output, const TileWork&,
                                                   const Progress&);
  ~FolderWriter() override;

  std::uint64_t unsound() const override { return unsound_; }
  std::optional<TileFacts> finished(std::size_t k) const override;
  Result<void> write(std::size_t k, std::string_view bytes, TileFacts facts) override;
  Result<void> commit() override;
  Result<void> finish(std::string_view layer_json) override;
  std::string index_path() const override { return output_ + kResiduals; }

 private:
  FolderWriter(std::shared_ptr<FolderFiles> files, FolderLock lock, const std::string& output,
               const TileWork& work)
      : shared_files_(std::move(files)),
        files_(*shared_files_),
        lock_(std::move(lock)),
        ids_(work.ids),
        threads_(work.threads),
        batch_(std::size_t(work.batch)),
        output_(output),
        partial_(output) {}

  const std::shared_ptr<FolderFiles> shared_files_;
  FolderFiles& files_;
  FolderLock lock_;
  const TileOrder& ids_;
  const int threads_;
  const std::size_t batch_;
  const std::string output_;
  PartialPaths partial_;
  std::optional<TileLedger> ledger_;  // of the tiles in their places
  std::optional<TileLedger> aside_;   // of an update; names all tiles
  std::vector<std::uint8_t> dirty_;   // by tile: is made aside. Empty: no update
  std::vector<std::uint8_t> sound_;   // by tile: is there as the ledger says. Empty: none
  std::uint64_t unsound_ = 0;
  bool claimed_ = false;

  std::mutex mutex_;  // of what follows
  std::vector<LedgerEntry> pending_;
  std::chrono::steady_clock::time_point last_commit_ = std::chrono::steady_clock::now();
  bool committing_ = false;

  bool is_aside(std::size_t k) const { return !dirty_.empty() && dirty_[k]; }
  std::string path(std::size_t k) const;
  Result<void> claim_empty(const TileWork&, const std::string& record);
  Result<void> go_on(const TileWork&, const std::string& record, const Progress&);
  Result<void> replace(const TileWork&, const std::string& record, const Json& found,
                       const std::string& why);
  Result<void> put(const std::string& path, std::string_view bytes);
  Result<void> put_record(const std::string& folder, const std::string& record, const TileWork&,
                          std::optional<TileLedger>&);
  Result<void> mend_blocks(const std::string& folder, const KeptBlocks&);
  Result<void> start(const std::string& record, const TileWork&);
  Result<void> start_update(const std::string& record, const TileWork&, const Progress&);
  Result<void> make_folders();
  std::vector<std::uint8_t> look_at_tiles(bool aside, const Progress&);
  Result<void> enter(std::vector<LedgerEntry>);
};

/// Which tiles depend on heights that changed since those here were made.
Result<std::vector<std::uint8_t>> changes_since(const std::string& record, const TileWork& work,
                                                const std::string& output) {
  const BuildRecord old = decode_build_record(record).value_or(BuildRecord{});
  const std::string path = output + kBlocks + old.heights;
  const auto bytes = read_regular_file(path);
  if (!bytes) return std::unexpected(bytes.error());
  auto dirty = work.changes(old, *bytes);
  if (!dirty) return fail(path, dirty.error());
  return dirty;
}

/// Why tiles made as `found` says are not those that are wanted.
std::string difference(const Json& found, const Json& wanted) {
  if (!is_record(found)) return "a damaged record of a build";
  if (found.value("format", Json()) != wanted["format"])
    return "tiles of a version of tind that kept no ledger of them";
  if (found.value("epoch", Json()) == 0)
    return "copied tiles, of which no record says how they were made";
  if (found.value("epoch", Json()) != wanted["epoch"]) {
    return "tiles of another version of tind, which makes other bytes of the same posts (epoch " +
           found.value("epoch", Json()).dump() + ", not " + wanted["epoch"].dump() + ")";
  }
  if (found.value("grid", Json()) != wanted["grid"]) return "tiles of another source";
  if (found.value("shapes", Json()) != wanted.value("shapes", Json()))
    return "tiles with other lines or water";
  return "tiles of other options";
}

std::unexpected<Error> refused(const std::string& folder, const std::string& why,
                               const std::string& what_to_do) {
  return fail(Errc::invalid_argument, folder + " holds " + why + ": " + what_to_do);
}

/// A ledger of this folder that says what it says of the tiles of this record. Fails where it
/// cannot be read: who took that for none would make all tiles again.
Result<std::optional<TileLedger>> ledger_of(const std::string& folder, const std::string& record) {
  auto ledger = TileLedger::open(folder + kLedger);
  if (!ledger && ledger.error().code == Errc::io) return std::unexpected(ledger.error());
  if (!ledger || !ledger->belongs_to(record)) return std::nullopt;
  return std::optional(std::move(*ledger));
}

/// The same, where it has a place for each of these.
Result<std::optional<TileLedger>> ledger_in(const std::string& folder, const std::string& record,
                                            const TileOrder& ids) {
  auto ledger = ledger_of(folder, record);
  for (std::size_t k = 0; ledger && *ledger && k < ids.size(); ++k)
    if (!(*ledger)->names(ids[k])) return std::nullopt;
  return ledger;
}

Result<std::unique_ptr<TileWriter>> FolderWriter::claim(std::shared_ptr<FolderFiles> shared_files,
                                                        FolderLock lock, const std::string& output,
                                                        const TileWork& work,
                                                        const Progress& progress) {
  std::unique_ptr<FolderWriter> writer(
      new FolderWriter(std::move(shared_files), std::move(lock), output, work));
  const std::string path = output + kRecord;
  const auto before = type_of(path);
  if (!before) return std::unexpected(before.error());
  const bool began = writer->lock_.left_behind() || *before == fs::file_type::regular;
  if (auto ok = check_partial(output, began); !ok) return std::unexpected(ok.error());
  if (auto ok = look_aside(output, kAside); !ok) return std::unexpected(ok.error());
  if (auto done = adopt(writer->files_, output); !done) return std::unexpected(done.error());
  const std::string record = encode(work.record);
  const auto now = type_of(path);
  if (!now) return std::unexpected(now.error());
  const bool empty = *now == fs::file_type::not_found;
  auto done = empty ? writer->claim_empty(work, record) : writer->go_on(work, record, progress);
  if (!done) return std::unexpected(done.error());
  return writer;
}

Result<void> FolderWriter::claim_empty(const TileWork& work, const std::string& record) {
  for (const char* other : {kLayer, kImagesRecord, kSceneryRecord, kCdbRecord}) {
    const auto type = type_of(output_ + other);
    if (!type) return std::unexpected(type.error());
    if (*type == fs::file_type::not_found) continue;
    return refused(output_,
                   other == kLayer ? "a tile set that tind build did not make"
                                   : fmt::format("what another format made ({})", other + 1),
                   "choose another directory");
  }
  const auto none = [](TileId) { return false; };
  if (auto ok = check_way(output_, ids_, false, none); !ok) return ok;
  if (auto ok = check_blocks(output_, work.blocks.digest, false); !ok) return ok;
  return start(record, work);
}

/// Where there is a record.
Result<void> FolderWriter::go_on(const TileWork& work, const std::string& record,
                                 const Progress& progress) {
  const auto text = read_regular_file(output_ + kRecord);
  if (!text) return std::unexpected(text.error());
  const Json wanted = json::parse<Json>(record), found = json::parse<Json>(*text);
  const bool same = found == wanted;
  const bool update = is_record(found) && !same && is_update(found, wanted);
  if (!same && !update) return replace(work, record, found, difference(found, wanted));
  auto ledger = update ? ledger_of(output_, *text) : ledger_in(output_, *text, ids_);
  if (!ledger) return std::unexpected(ledger.error());
  ledger_ = std::move(*ledger);
  // Other tiles than before: which of those that are here are ours, only the ledger says.
  const bool others = update && found.contains("layers") && found["layers"] != wanted["layers"];
  if (others && !ledger_)
    return replace(work, record, found, "tiles of other layers or files, and no whole ledger");
  const auto own = [&](TileId id) { return !others || ledger_->names(id); };
  if (auto ok = check_way(output_, ids_, true, own); !ok) return ok;
  if (auto ok = check_blocks(output_, work.blocks.digest, same); !ok) return ok;
  if (auto done = remove_partial_files(files_, output_); !done) return done;
  if (update) {
    const auto layer = layer_in(output_);
    if (!layer) return std::unexpected(layer.error());
    if (*layer && !work.force)
      if (auto ok = most_stay(output_, (*layer)->available, work.levels); !ok) return ok;
    auto dirty = changes_since(*text, work, output_);
    if (!dirty && dirty.error().code == Errc::io) return std::unexpected(dirty.error());
    if (!dirty) {
      return replace(
          work, record, found,
          "tiles of other heights, and what changed cannot be told (" + dirty.error().what + ")");
    }
    dirty_ = std::move(*dirty);
    if (auto done = start_update(record, work, progress); !done) return done;
  } else {
    claimed_ = true;
    // An update to content that has gone again.
    if (auto done = remove_aside(files_, output_, kAside); !done) return done;
    if (auto done = ledger_ ? make_folders() : start(record, work); !done) return done;
    if (auto done = mend_blocks(output_, work.blocks); !done) return done;
    sound_ = look_at_tiles(false, progress);
  }
  if (progress.stopped()) return fail(Errc::cancelled, "stopped while looking at finished tiles");
  return {};
}

/// Starts afresh in place of tiles that are ours, if that is wanted.
Result<void> FolderWriter::replace(const TileWork& work, const std::string& record,
                                   const Json& found, const std::string& difference) {
  const std::string why = difference + " (see " + output_ + kRecord + ")";
  if (!work.force)
    return refused(output_, why, "choose another directory, or --force to replace them");
  const auto old = TileLedger::open(output_ + kLedger);
  if (!old && old.error().code == Errc::io) return std::unexpected(old.error());
  if (!old) {
    return refused(output_, why,
                   "without a whole ledger --force cannot tell which of them are "
                   "tind's to replace; choose another directory, or remove this one");
  }
  const auto named = [&](TileId id) { return old->names(id); };
  if (auto ok = check_way(output_, ids_, true, named); !ok) return ok;
  const bool same_heights =
      is_record(found) && found.value("heights", Json()) == work.record.heights;
  if (auto ok = check_blocks(output_, work.blocks.digest, same_heights); !ok) return ok;
  // So that no old tile can be taken for one of ours.
  if (auto done = files_.remove(output_ + kLayer); !done) return done;
  if (auto done = files_.sync_folder(output_); !done) return done;
  const auto all = [](TileId) { return true; };
  if (auto done = remove_tiles(files_, output_, *old, all); !done) return done;
  if (auto done = remove_aside(files_, output_, kAside); !done) return done;
  // A tile that comes back must not be met by a ledger that does not name it.
  if (auto done = files_.sync_all(output_); !done) return done;
  return start(record, work);
}

FolderWriter::~FolderWriter() {
  // Else the next build does, and goes by the lock's file.
  if (claimed_ && !remove_partial_files(files_, output_)) lock_.leave_behind();
}

std::string FolderWriter::path(std::size_t k) const {
  return tile_path(is_aside(k) ? output_ + kAside : output_, ids_[k]);
}

/// Aside, synced, renamed, synced: what was there, or this, and from here on this.
Result<void> FolderWriter::put(const std::string& path, std::string_view bytes) {
  const std::string partial = partial_.next();
  if (auto done = files_.make_folder(output_ + kPartial); !done) return done;
  if (auto done = files_.write(partial, bytes); !done) return done;
  if (auto done = files_.sync_file(partial); !done) return done;
  if (auto done = files_.rename(partial, path); !done) return done;
  return files_.sync_folder(fs::path(path).parent_path().string());
}

/// Blocks, an empty ledger and the record that needs both.
Result<void> FolderWriter::put_record(const std::string& folder, const std::string& record,
                                      const TileWork& work, std::optional<TileLedger>& ledger) {
  const KeptBlocks& blocks = work.blocks;
  if (const std::string bytes = blocks.encode(); !bytes.empty())
    if (auto done = put(folder + kBlocks + blocks.digest, bytes); !done) return done;
  if (auto done = put(folder + kLedger, TileLedger::blank(record, work.levels)); !done) return done;
  if (auto done = put(folder + kRecord, record); !done) return done;
  auto opened = TileLedger::open(folder + kLedger);
  if (!opened) return std::unexpected(opened.error());
  ledger = std::move(*opened);
  return {};
}

/// The blocks' file is only read by the next update, which a damaged one would stop.
Result<void> FolderWriter::mend_blocks(const std::string& folder, const KeptBlocks& blocks) {
  const std::string path = folder + kBlocks + blocks.digest, wanted = blocks.encode();
  if (wanted.empty()) return {};
  if (const auto found = read_regular_file(path); found && *found == wanted) return {};
  return put(path, wanted);
}

Result<void> FolderWriter::start(const std::string& record, const TileWork& work) {
  claimed_ = true;
  if (auto done = remove_partial_files(files_, output_); !done)
    return std::unexpected(done.error());
  if (auto done = put_record(output_, record, work, ledger_); !done)
    return std::unexpected(done.error());
  if (auto done = remove_other_blocks(files_, output_, work.blocks.digest); !done)
    return std::unexpected(done.error());
  return make_folders();
}

Result<void> FolderWriter::start_update(const std::string& record, const TileWork& work,
                                        const Progress& progress) {
  std::vector<std::uint8_t> kept = look_at_tiles(false, progress.part(0, 0.5));
  for (std::size_t k = 0; k < kept.size(); ++k) dirty_[k] = dirty_[k] || !kept[k];
  const std::string aside = output_ + kAside;
  claimed_ = true;
  // What an earlier run to the same content left there.
  const auto text = read_regular_file(aside + kRecord);
  if (!text && text.error().code != Errc::not_found) return std::unexpected(text.error());
  if (text && *text == record) {
    auto ledger = ledger_in(aside, record, ids_);
    if (!ledger) return std::unexpected(ledger.error());
    aside_ = std::move(*ledger);
  }
  if (aside_) {
    if (auto done = mend_blocks(aside, work.blocks); !done) return done;
  } else {
    if (auto done = remove_aside(files_, output_, kAside); !done) return done;
    if (auto done = files_.make_folder(aside); !done) return done;
    if (auto done = put_record(aside, record, work, aside_); !done) return done;
  }
  if (auto done = make_folders(); !done) return done;
  sound_ = look_at_tiles(true, progress.part(0.5, 1));
  for (std::size_t k = 0; k < kept.size(); ++k) sound_[k] = sound_[k] || kept[k];
  return {};
}

Result<void> FolderWriter::make_folders() {
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
std::vector<std::uint8_t> FolderWriter::look_at_tiles(bool aside, const Progress& progress) {
  std::vector<std::uint8_t> sound(ids_.size());
  const std::optional<TileLedger>& ledger = aside ? aside_ : ledger_;
  std::atomic<std::uint64_t> unsound = 0;
  std::atomic<std::size_t> done = 0;
  parallel_for(ids_.size(), threads_, [&](std::size_t k) {
    if (is_aside(k) != aside || progress.stopped()) return;
    // A tile whose entry cannot be read is made again.
    const auto entry =
        ledger ? ledger->find(ids_[k]).value_or(std::nullopt) : std::optional<LedgerEntry>();
    if (entry) {
      const auto bytes = read_regular_file(path(k));
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

std::optional<TileFacts> FolderWriter::finished(std::size_t k) const {
  if (sound_.empty() || !sound_[k]) return {};
  const auto entry = (is_aside(k) ? aside_ : ledger_)->find(ids_[k]);
  if (!entry || !*entry) return {};
  return (*entry)->facts;
}

Result<void> FolderWriter::write(std::size_t k, std::string_view bytes, TileFacts facts) {
  const std::string partial = partial_.next();
  if (auto done = files_.write(partial, bytes); !done) return done;
  if (auto done = files_.rename(partial, path(k)); !done) return done;
  LedgerEntry known{.id = ids_[k], .facts = facts};
  known.take(bytes);
  {
    const std::lock_guard lock(mutex_);
    pending_.push_back(known);
    if (pending_.size() < batch_ &&
        std::chrono::steady_clock::now() - last_commit_ < kLongestPending)
      return {};
    if (committing_) return {};  // another thread is at it
  }
  return commit();
}

Result<void> FolderWriter::commit() {
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
Result<void> FolderWriter::enter(std::vector<LedgerEntry> entries) {
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

Result<void> FolderWriter::finish(std::string_view layer_json) {
  if (auto done = commit(); !done) return done;
  if (!aside_) return put(output_ + kLayer, layer_json);
  // What stays is vouched for by the old ledger until now, and by the new one from now on.
  std::vector<LedgerEntry> kept;
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    if (!is_aside(k)) {
      const auto entry = ledger_->find(ids_[k]);
      if (!entry) return std::unexpected(entry.error());
      if (!*entry) return fail(Errc::io, output_ + kLedger + " was changed meanwhile");
      kept.push_back(**entry);
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

class LockedFolder : public LockedStore {
 public:
  LockedFolder(std::shared_ptr<FolderFiles> files, FolderLock lock, std::string directory)
      : files_(std::move(files)), lock_(std::move(lock)), directory_(std::move(directory)) {}

  Result<std::unique_ptr<TileWriter>> claim(const TileWork& work,
                                            const Progress& progress) override {
    return FolderWriter::claim(files_, std::move(lock_), directory_, work, progress);
  }

 private:
  const std::shared_ptr<FolderFiles> files_;
  FolderLock lock_;
  const std::string directory_;
};

}  // namespace

Result<std::unique_ptr<LockedStore>> lock_folder(const std::string& directory,
                                                 std::shared_ptr<FolderFiles> files) {
  if (auto alone = lies_in_no_level(directory); !alone) return std::unexpected(alone.error());
  if (!files) files = std::make_shared<FolderFiles>();
  if (auto made = files->make_folder(directory); !made) return std::unexpected(made.error());
  auto lock = FolderLock::take(directory);
  if (!lock) return std::unexpected(lock.error());
  return std::make_unique<LockedFolder>(std::move(files), std::move(*lock), directory);
}

}  // namespace tind
