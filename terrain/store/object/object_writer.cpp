// A journal is an object of rows, one for each tile that was written since the last one: its
// address, the MD5 that the store must list it with, and its entry of the ledger. Whoever goes on
// believes a row only where the store lists that MD5, or where the tile, read again, is as its
// entry says. Rows of another record are told by the seed of their entries.

#include "terrain/store/object/object_writer.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <map>
#include <mutex>
#include <set>
#include <utility>

#include "terrain/base/bytes.h"
#include "terrain/base/hash.h"
#include "terrain/base/md5.h"
#include "terrain/base/parallel.h"
#include "terrain/store/folder/tile_ledger.h"
#include "terrain/store/object/object_names.h"
#include "terrain/store/object/object_store.h"

namespace tind {

using namespace folder;

namespace {

using Bytes = std::vector<std::uint8_t>;
using Md5 = std::array<std::uint8_t, 16>;

constexpr std::chrono::seconds kLongestPending{4};
constexpr int kThreads = 8;  // mostly waiting for answers
constexpr std::string_view kMagic = "tindJRN1";
constexpr std::size_t kRow = 12 + 16 + kLedgerPlace;

std::string_view text_of(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string hex_of(const Md5& hash) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t b : hash) {
    text += kDigits[b >> 4];
    text += kDigits[b & 15];
  }
  return text;
}

struct Row {
  LedgerEntry entry;
  Md5 md5{};
};

void append(std::string& journal, const Row& row, std::uint64_t seed) {
  ByteWriter<std::string> out(journal);
  out.put(std::uint32_t(row.entry.id.level));
  out.put(std::uint32_t(row.entry.id.x));
  out.put(std::uint32_t(row.entry.id.y));
  out.put_text({reinterpret_cast<const char*>(row.md5.data()), row.md5.size()});
  out.put_text(encode_place(row.entry, seed));
}

/// What is sound of it.
void read_journal(std::string_view bytes, std::uint64_t seed, std::map<TileId, Row>& rows) {
  if (!bytes.starts_with(kMagic)) return;
  for (bytes.remove_prefix(kMagic.size()); bytes.size() >= kRow; bytes.remove_prefix(kRow)) {
    ByteReader in(bytes.substr(0, kRow));
    const auto level = in.get<std::uint32_t>(), x = in.get<std::uint32_t>(),
               y = in.get<std::uint32_t>();
    Row row;
    const std::string_view md5 = bytes.substr(12, row.md5.size());
    std::ranges::copy(md5, row.md5.begin());
    const auto id = tiling::tile(level, x, y);
    const auto entry = id ? decode_place(bytes.substr(28, kLedgerPlace), *id, seed) : std::nullopt;
    if (!entry) continue;
    row.entry = *entry;
    rows.insert_or_assign(*id, row);
  }
}

/// Differs from that of every other writer, on this host and others.
std::string writer_name() {
  static std::atomic<std::uint64_t> writers = 0;
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host = {"?"};
  const auto now = std::chrono::system_clock::now().time_since_epoch().count();
  return hash128(std::string(host.data()) + " " + std::to_string(::getpid()) + " " +
                 std::to_string(now) + " " + std::to_string(writers++))
      .text();
}

class ObjectWriter : public TileWriter {
 public:
  ObjectWriter(std::string base, const remote::Objects& objects, const TileWork& work)
      : base_(std::move(base)),
        objects_(objects),
        ids_(work.ids),
        record_(encode(work.record)),
        blank_(TileLedger::blank(record_, work.levels)),
        seed_(hash64(record_)),
        batch_(std::size_t(work.batch)),
        name_(writer_name()) {}

  Result<void> claim(const TileWork&, const Progress&);

  std::uint64_t unsound() const override { return unsound_; }
  std::optional<TileFacts> finished(std::size_t k) const override {
    const auto found = done_.find(ids_[k]);
    if (found == done_.end()) return {};
    return found->second.facts;
  }
  Result<void> write(std::size_t k, std::string_view bytes, TileFacts facts) override;
  Result<void> commit() override;
  Result<void> finish(std::string_view layer_json) override;

 private:
  const std::string base_;
  const remote::Objects objects_;
  const TileOrder& ids_;
  const std::string record_, blank_;
  const std::uint64_t seed_;
  const std::size_t batch_;
  const std::string name_;
  std::map<TileId, LedgerEntry> done_;  // before this run
  std::uint64_t unsound_ = 0, journals_ = 0;

  std::mutex mutex_;  // of what follows
  std::map<TileId, LedgerEntry> written_;
  std::vector<Row> pending_;
  std::chrono::steady_clock::time_point last_commit_ = std::chrono::steady_clock::now();
  bool committing_ = false;

  Result<void> put(const std::string& name, std::string_view bytes) {
    const auto done = objects_.put(base_ + name, bytes, "application/octet-stream");
    if (!done) return std::unexpected(done.error());
    return {};
  }
  Result<void> put_record(const KeptBlocks&);
  Result<void> replace(const std::vector<remote::ListedObject>&, const TileWork&);
  Result<void> go_on(const std::vector<remote::ListedObject>&, const TileWork&, const Progress&);
  Result<void> still_ours() const;
};

/// The record comes after what it stands for and before the first tile.
Result<void> ObjectWriter::put_record(const KeptBlocks& blocks) {
  if (const std::string bytes = blocks.encode ? blocks.encode() : ""; !bytes.empty())
    if (auto done = put(kBlocks + blocks.digest, bytes); !done) return done;
  return put(kRecord, record_);
}

Result<void> ObjectWriter::claim(const TileWork& work, const Progress& progress) {
  if (const std::size_t most = (kLargestObject - blank_.size()) / kLedgerPlace; ids_.size() > most)
    return fail(Errc::out_of_range,
                base_ + ": " + std::to_string(ids_.size()) + " tiles are more than the " +
                    std::to_string(most) +
                    " of which a prefix can keep hashes: name an archive there (X.pmtiles)");
  const auto there = objects_.list(base_ + "/");
  if (!there) return std::unexpected(there.error());
  const auto record = objects_.get(base_ + kRecord, kLargestObject);
  if (!record && record.error().code != Errc::not_found) return std::unexpected(record.error());
  if (!record) {
    const auto ours = [&](const remote::ListedObject& one) {
      return is_object_of_build(one.key, work.blocks.digest) && one.key != kLayer + 1;
    };
    const auto other = std::ranges::find_if_not(*there, ours);
    if (other != there->end())
      return fail(Errc::invalid_argument, base_ + "/" + other->key +
                                              " is there, and tind did not make it: choose "
                                              "another prefix");
    return put_record(work.blocks);
  }
  if (text_of(record->bytes) == record_) return go_on(*there, work, progress);
  if (!work.force)
    return fail(Errc::invalid_argument,
                base_ + " holds tiles of another source or of other options (see " + base_ +
                    kRecord +
                    "), and objects are not updated in place: choose another prefix, or "
                    "--force to replace them");
  if (auto gone = replace(*there, work); !gone) return gone;
  return put_record(work.blocks);
}

/// Removes what a ledger or a journal of the old record names, layer.json first, the record last.
Result<void> ObjectWriter::replace(const std::vector<remote::ListedObject>& there,
                                   const TileWork& work) {
  const auto old = objects_.get(base_ + kRecord, kLargestObject);
  if (!old) return std::unexpected(old.error());
  std::map<TileId, Row> rows;
  const auto ledger = objects_.get(base_ + kLedger, kLargestObject);
  if (!ledger && ledger.error().code == Errc::io) return std::unexpected(ledger.error());
  const auto known = ledger ? TileLedger::of_bytes(text_of(ledger->bytes), base_ + kLedger)
                            : Result<TileLedger>(std::unexpected(ledger.error()));
  const auto made = decode_build_record(text_of(old->bytes));
  for (const remote::ListedObject& one : there) {
    if (!one.key.starts_with(kJournal + 1)) continue;
    const auto bytes = objects_.get(base_ + "/" + one.key, kLargestObject);
    if (!bytes && bytes.error().code == Errc::io) return std::unexpected(bytes.error());
    if (bytes) read_journal(text_of(bytes->bytes), hash64(text_of(old->bytes)), rows);
  }
  std::vector<std::string> gone, last;
  for (const remote::ListedObject& one : there) {
    const auto id = tile_of_path(one.key);
    const bool own = id ? rows.contains(*id) || (known && known->names(*id))
                        : is_object_of_build(one.key, made ? made->heights : "");
    if (!own)
      return fail(Errc::invalid_argument, base_ + "/" + one.key +
                                              " is not known to be tind's to replace: choose "
                                              "another prefix");
    (id ? gone : last).push_back("/" + one.key);
  }
  if (auto done = objects_.remove(base_ + kLayer); !done) return done;
  std::vector<Result<void>> results(gone.size());
  parallel_for(gone.size(), kThreads,
               [&](std::size_t k) { results[k] = objects_.remove(base_ + gone[k]); });
  for (const auto& result : results)
    if (!result) return result;
  for (const std::string& name : last)
    if (name != kRecord)
      if (auto done = objects_.remove(base_ + name); !done) return done;
  (void)work;
  return objects_.remove(base_ + kRecord);
}

Result<void> ObjectWriter::go_on(const std::vector<remote::ListedObject>& there,
                                 const TileWork& work, const Progress& progress) {
  std::map<TileId, Row> rows;
  std::map<TileId, const remote::ListedObject*> tiles;
  for (const remote::ListedObject& one : there) {
    if (const auto id = tile_of_path(one.key)) tiles[*id] = &one;
    if (!one.key.starts_with(kJournal + 1)) continue;
    const auto bytes = objects_.get(base_ + "/" + one.key, kLargestObject);
    if (!bytes) return std::unexpected(bytes.error());
    read_journal(text_of(bytes->bytes), seed_, rows);
  }
  const auto bytes = objects_.get(base_ + kLedger, kLargestObject);
  if (!bytes && bytes.error().code != Errc::not_found) return std::unexpected(bytes.error());
  const auto ledger = bytes ? TileLedger::of_bytes(text_of(bytes->bytes), base_ + kLedger)
                            : Result<TileLedger>(std::unexpected(bytes.error()));
  std::vector<std::optional<LedgerEntry>> sound(ids_.size());
  std::vector<std::uint8_t> unsound(ids_.size());
  std::atomic<std::size_t> looked = 0;
  parallel_for(ids_.size(), std::max(work.threads, kThreads), [&](std::size_t k) {
    if (progress.stopped()) return;
    const auto tile = tiles.find(ids_[k]);
    const auto row = rows.find(ids_[k]);
    std::optional<LedgerEntry> entry;
    if (row != rows.end()) entry = row->second.entry;
    if (!entry && ledger) entry = ledger->find(ids_[k]).value_or(std::nullopt);
    if (tile != tiles.end() && entry && tile->second->size == entry->facts.size) {
      const bool listed = row != rows.end() && tile->second->etag == hex_of(row->second.md5);
      const auto read = listed ? Result<remote::ObjectBytes>(remote::ObjectBytes{})
                               : objects_.get(tile_path(base_, ids_[k]), kLargestStored);
      if (listed || (read && entry->vouches_for(text_of(read->bytes)))) sound[k] = entry;
    }
    unsound[k] = !sound[k] && (tile != tiles.end() || entry);
    if (++looked % std::max<std::size_t>(1, ids_.size() / 200) == 0)
      progress.at(double(looked) / double(ids_.size()));
  });
  if (progress.stopped()) return fail(Errc::cancelled, "stopped while looking at finished tiles");
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    if (sound[k]) done_.emplace(ids_[k], *sound[k]);
    unsound_ += unsound[k];
  }
  return {};
}

Result<void> ObjectWriter::write(std::size_t k, std::string_view bytes, TileFacts facts) {
  const auto put = objects_.put(tile_path(base_, ids_[k]), bytes, "application/vnd.quantized-mesh");
  if (!put) return std::unexpected(put.error());
  Row row{{.id = ids_[k], .facts = facts}, md5(bytes)};
  row.entry.take(bytes);
  {
    const std::lock_guard lock(mutex_);
    written_.insert_or_assign(row.entry.id, row.entry);
    pending_.push_back(row);
    if (pending_.size() < batch_ &&
        std::chrono::steady_clock::now() - last_commit_ < kLongestPending)
      return {};
    if (committing_) return {};  // another thread is at it
  }
  return commit();
}

Result<void> ObjectWriter::still_ours() const {
  const auto record = objects_.get(base_ + kRecord, kLargestObject);
  if (!record && record.error().code != Errc::not_found) return std::unexpected(record.error());
  if (record && text_of(record->bytes) == record_) return {};
  return fail(Errc::busy, base_ + ": another build has taken this prefix");
}

Result<void> ObjectWriter::commit() {
  std::vector<Row> rows;
  std::uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    if (committing_ || pending_.empty()) return {};
    committing_ = true;
    rows.swap(pending_);
    number = journals_++;
  }
  std::string journal(kMagic);
  for (const Row& row : rows) append(journal, row, seed_);
  auto done = still_ours();
  if (done) done = put(kJournal + name_ + "-" + std::to_string(number), journal);
  const std::lock_guard lock(mutex_);
  committing_ = false;
  last_commit_ = std::chrono::steady_clock::now();
  return done;
}

Result<void> ObjectWriter::finish(std::string_view layer_json) {
  if (auto done = commit(); !done) return done;
  if (auto ours = still_ours(); !ours) return ours;
  const auto places = TileLedger::of_bytes(blank_, base_ + kLedger);
  if (!places) return std::unexpected(places.error());
  std::string ledger = blank_;
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    const auto now = written_.find(ids_[k]), before = done_.find(ids_[k]);
    const bool written = now != written_.end();
    if (!written && before == done_.end())
      return fail(Errc::internal, base_ + ": a tile was not finished");
    const std::size_t at = places->offset(ids_[k]);
    if (ledger.size() < at + kLedgerPlace) ledger.resize(at + kLedgerPlace);
    ledger.replace(at, kLedgerPlace, places->encode(written ? now->second : before->second));
  }
  if (auto done = put(kLedger, ledger); !done) return done;
  const auto layer = objects_.put(base_ + kLayer, layer_json, "application/json");
  if (!layer) return std::unexpected(layer.error());
  // From here on the ledger says it all.
  const auto journals = objects_.list(base_ + kJournal);
  if (!journals) return std::unexpected(journals.error());
  for (const remote::ListedObject& one : *journals)
    if (auto done = objects_.remove(base_ + kJournal + one.key); !done) return done;
  return {};
}

class UnlockedObjects : public LockedStore {
 public:
  UnlockedObjects(std::string base, const remote::Objects& objects)
      : base_(std::move(base)), objects_(objects) {}

  Result<std::unique_ptr<TileWriter>> claim(const TileWork& work,
                                            const Progress& progress) override {
    auto writer = std::make_unique<ObjectWriter>(base_, objects_, work);
    if (auto done = writer->claim(work, progress); !done) return std::unexpected(done.error());
    return writer;
  }

 private:
  const std::string base_;
  const remote::Objects objects_;
};

}  // namespace

std::unique_ptr<LockedStore> lock_objects(const std::string& url, const remote::Objects& objects) {
  return std::make_unique<UnlockedObjects>(object_prefix(url), objects);
}

}  // namespace tind
