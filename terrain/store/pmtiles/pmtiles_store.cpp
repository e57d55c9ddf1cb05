// A tile is found by way of the root and at most three leaves, and read at once; where the archive
// has a seal, a second reading is of what vouches for it.

#include "terrain/store/pmtiles/pmtiles_store.h"

#include <algorithm>
#include <mutex>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "proto/json_member.h"
#include "proto/json_text.h"
#include "terrain/base/deflate.h"
#include "terrain/base/hash.h"
#include "terrain/base/lru.h"
#include "terrain/raster/remote/objects.h"
#include "terrain/store/ledger_entry.h"
#include "terrain/store/pmtiles/archive_bytes.h"
#include "terrain/store/pmtiles/pmtiles_seal.h"

namespace tind {

namespace {

using namespace pmtiles;
using proto::PmtilesEntry;
using proto::PmtilesHeader;
using proto::PmtilesPacking;
using proto::PmtilesSection;
using Bytes = std::vector<std::uint8_t>;
using Directory = std::vector<PmtilesEntry>;

constexpr std::size_t kLargestPart = 64u << 20;  // packed or not: the metadata
// A directory, unpacked: a million entries at most, in 24 MB. Those of an archive of tind's that
// has 400 million tiles have 131,072.
constexpr std::size_t kLargestDirectory = 4u << 20;
constexpr std::size_t kLeavesKept = 32u << 20;  // bytes of all of them
constexpr int kDeepestLeaf = 4;                 // root, and leaves of leaves
constexpr std::size_t kAtOnce = 4u << 20;

std::string_view text_of(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

bool lies_in(const PmtilesSection& part, const PmtilesSection& whole) {
  return part.at >= whole.at && part.end() <= whole.end();
}

/// What opening reads.
struct Head {
  PmtilesHeader header;
  Directory root;
  std::string layer, record;
  std::optional<Seal> seal;
  std::uint64_t seed = 0;  // of the entries
};

class PmtilesStore : public TileStore {
 public:
  explicit PmtilesStore(const std::string& path)
      : path_(path), file_(open_archive_bytes(path)), leaves_(kLeavesKept) {
    head_ = open();
  }

  std::string name() const override { return path_; }
  std::string layer_name() const override { return path_; }
  std::string tile_name(TileId id) const override { return path_ + " " + id.text(); }
  bool remote() const override { return remote::is_remote(path_); }

  Result<Bytes> layer_json() const override {
    if (!head_) return std::unexpected(head_.error());
    return Bytes(head_->layer.begin(), head_->layer.end());
  }
  Result<std::optional<BuildRecord>> record() const override {
    if (!head_) return without_record(head_.error());
    if (head_->record.empty()) return std::nullopt;
    return decode_build_record(head_->record);
  }
  Result<std::string> kept_blocks() const override;

  Result<Bytes> read(TileId) const override;
  Result<StoredTile> look_at(TileId) const override;
  Result<std::optional<std::uint64_t>> size(TileId id) const override {
    const auto found = find(id);
    if (found) return found->entry.size;
    if (found.error().code == Errc::io) return std::unexpected(found.error());
    return std::nullopt;
  }
  Result<std::optional<StoreListing>> list() const override;

  std::optional<std::uint64_t> generation() const override {
    if (!head_ || !head_->seal) return {};
    return head_->seal->hash();
  }
  Result<void> vouched_for() const override {
    if (!head_) return std::unexpected(head_.error());
    return {};
  }
  std::vector<StoreFault> faults() const override;

 private:
  struct Found {
    PmtilesEntry entry;
    std::uint64_t number = 0;  // among all tiles, in their order; where there is a seal
  };

  const std::string path_;
  const Result<std::unique_ptr<const ArchiveBytes>> file_;  // read where there is a head
  Result<Head> head_ = fail(Errc::internal, "not opened");
  mutable std::mutex mutex_;
  mutable Lru<std::uint64_t, std::shared_ptr<const Directory>> leaves_;  // by place

  std::unexpected<Error> damaged(const std::string& what) const {
    return fail(Errc::bad_data, path_ + ": " + what);
  }
  Result<Head> open() const;
  Result<void> open_sealed(Head&) const;
  Result<Bytes> unpacked(const PmtilesSection&, PmtilesPacking, std::size_t most) const;
  Result<Directory> directory(const PmtilesSection&, PmtilesPacking) const;
  Result<std::shared_ptr<const Directory>> leaf(const PmtilesEntry&) const;
  Result<Found> find(TileId) const;
  Result<Bytes> tile_bytes(const PmtilesEntry&) const;
  Result<void> each_entry(const Directory&, int depth, std::uint64_t& left,
                          const std::function<void(const PmtilesEntry&)>&) const;
  PmtilesSection entries_section() const {
    return {head_->header.tiles.at + head_->seal->entries_at, head_->seal->tiles * kLedgerPlace};
  }
};

Result<Bytes> PmtilesStore::unpacked(const PmtilesSection& part, PmtilesPacking packing,
                                     std::size_t most) const {
  if (part.size > most) return damaged("a part of it is too large");
  auto bytes = (*file_)->read(part);
  if (!bytes || packing == PmtilesPacking::none) return bytes;
  if (packing != PmtilesPacking::gzip)
    return fail(Errc::unsupported, path_ + " is packed otherwise than with gzip");
  auto plain = gunzip(*bytes, most);
  if (!plain) return damaged("damaged gzip data, or a part of it is too large");
  return plain;
}

Result<Directory> PmtilesStore::directory(const PmtilesSection& part,
                                          PmtilesPacking packing) const {
  const auto bytes = unpacked(part, packing, kLargestDirectory);
  if (!bytes) return std::unexpected(bytes.error());
  auto entries = proto::decode_pmtiles_directory(*bytes);
  if (!entries) return fail(path_, entries.error());
  return entries;
}

Result<Head> PmtilesStore::open() const {
  if (!file_) return std::unexpected(file_.error());
  const auto first =
      (*file_)->read({0, std::min<std::uint64_t>((*file_)->size(), proto::kPmtilesHeaderBytes)});
  if (!first) return std::unexpected(first.error());
  const auto header = proto::decode_pmtiles_header(*first);
  if (!header) return fail(path_, header.error());
  Head head{.header = *header, .root = {}, .layer = {}, .record = {}, .seal = {}};
  for (const PmtilesSection* part :
       {&header->root, &header->metadata, &header->leaves, &header->tiles})
    if (!lies_in(*part, {0, (*file_)->size()}))
      return damaged("is cut off, or its header is damaged");
  auto root = directory(header->root, header->directories_are);
  if (!root) return std::unexpected(root.error());
  head.root = std::move(*root);
  const auto metadata = unpacked(header->metadata, header->directories_are, kLargestPart);
  if (!metadata) return std::unexpected(metadata.error());
  const auto j = json::parse<nlohmann::json>(*metadata);
  const auto layer = j.is_object() ? json::text(j, kLayer) : std::nullopt;
  if (!layer)
    return fail(
        Errc::unsupported,
        path_ + " holds no quantized-mesh tiles that tind packed: its metadata have no " + kLayer);
  head.layer = *layer;
  head.record = json::text(j, kRecord).value_or("");
  head.seed = hash64(head.record, hash64(head.layer));
  if (j.contains(kSealed))
    if (auto done = open_sealed(head); !done) return std::unexpected(done.error());
  return head;
}

/// The parts lie one behind the other, and the seal knows all but the tiles and leaves.
Result<void> PmtilesStore::open_sealed(Head& head) const {
  const PmtilesHeader& h = head.header;
  const PmtilesSection whole{0, (*file_)->size()};
  if (h.root.at != proto::kPmtilesHeaderBytes || h.metadata.at != h.root.end() ||
      h.leaves.at != h.metadata.end() || h.tiles.at != h.leaves.end() ||
      h.tiles.end() != whole.end() || h.tiles.size < kSealBytes)
    return damaged("is cut off or longer than it was, or another program wrote it anew");
  const auto last = (*file_)->read({whole.end() - kSealBytes, kSealBytes});
  if (!last) return std::unexpected(last.error());
  head.seal = decode_seal(text_of(*last));
  if (!head.seal) return damaged("its end is damaged, or another program wrote it anew");
  const Seal& s = *head.seal;
  const std::uint64_t room = h.tiles.size - kSealBytes;
  if (s.entries_at > room || s.tiles > (room - s.entries_at) / kLedgerPlace ||
      s.blocks_size != room - s.entries_at - s.tiles * kLedgerPlace)
    return damaged("its end is damaged");
  const auto first = (*file_)->read({0, h.leaves.at});
  if (!first) return std::unexpected(first.error());
  if (hash64(*first) != s.head_hash) return damaged("its beginning is damaged");
  return {};
}

Result<std::string> PmtilesStore::kept_blocks() const {
  if (!head_) return std::unexpected(head_.error());
  if (!head_->seal || head_->seal->blocks_size == 0) return TileStore::kept_blocks();
  const PmtilesSection part{entries_section().end(), head_->seal->blocks_size};
  const auto bytes = (*file_)->read(part);
  if (!bytes) return std::unexpected(bytes.error());
  if (hash64(*bytes) != head_->seal->blocks_hash)
    return damaged("its hashes of blocks are damaged");
  return std::string(text_of(*bytes));
}

Result<std::shared_ptr<const Directory>> PmtilesStore::leaf(const PmtilesEntry& entry) const {
  {
    const std::lock_guard lock(mutex_);
    if (const auto* kept = leaves_.find(entry.at)) return *kept;
  }
  const PmtilesHeader& h = head_->header;
  if (entry.at > h.leaves.size || entry.size > h.leaves.size - entry.at)
    return damaged("a directory lies outside of it");
  auto entries = directory({h.leaves.at + entry.at, entry.size}, h.directories_are);
  if (!entries) return std::unexpected(entries.error());
  if (entries->empty() || entries->front().number != entry.number)
    return damaged("a directory begins with another tile than it should");
  auto made = std::make_shared<const Directory>(std::move(*entries));
  const std::lock_guard lock(mutex_);
  leaves_.insert(entry.at, made, made->size() * sizeof(PmtilesEntry));
  return made;
}

Result<PmtilesStore::Found> PmtilesStore::find(TileId id) const {
  if (!head_) return std::unexpected(head_.error());
  const std::uint64_t number = proto::pmtiles_number(place_of(id));
  std::shared_ptr<const Directory> kept;
  const Directory* entries = &head_->root;
  std::uint64_t before = 0;
  for (int depth = 0; depth < kDeepestLeaf; ++depth) {
    const auto next = std::ranges::upper_bound(*entries, number, {}, &PmtilesEntry::number);
    if (next == entries->begin()) break;
    const PmtilesEntry entry = *(next - 1);
    const auto place = std::uint64_t(next - 1 - entries->begin());
    if (entry.run > 0) {
      if (entry.number != number) break;
      return Found{entry, before + place};
    }
    if (head_->seal) before += place * head_->seal->leaf_entries;
    auto opened = leaf(entry);
    if (!opened) return std::unexpected(opened.error());
    kept = std::move(*opened);
    entries = kept.get();
  }
  return fail(Errc::not_found, path_ + " has no tile " + id.text());
}

Result<Bytes> PmtilesStore::tile_bytes(const PmtilesEntry& entry) const {
  const PmtilesSection& tiles = head_->header.tiles;
  if (entry.at > tiles.size || entry.size > tiles.size - entry.at || entry.size > kLargestStored)
    return damaged("a tile lies outside of it");
  const PmtilesPacking packing = head_->header.tiles_are;
  if (packing != PmtilesPacking::none && packing != PmtilesPacking::gzip)
    return fail(Errc::unsupported, path_ + ": tiles packed otherwise than with gzip");
  // Tiles lie along the curve: who wants one wants those beside it.
  return (*file_)->read_small({tiles.at + entry.at, entry.size});
}

Result<StoredTile> PmtilesStore::look_at(TileId id) const {
  const auto found = find(id);
  if (!found) return std::unexpected(found.error());
  auto bytes = tile_bytes(found->entry);
  if (!bytes) return std::unexpected(bytes.error());
  StoredTile tile{std::move(*bytes), Vouched::by_nobody};
  if (!head_->seal) return tile;
  tile.vouched = Vouched::not_listed;
  if (found->number >= head_->seal->tiles) return tile;
  const auto place =
      (*file_)->read_small({entries_section().at + found->number * kLedgerPlace, kLedgerPlace});
  if (!place) return std::unexpected(place.error());
  const auto entry = decode_place(text_of(*place), id, head_->seed);
  if (!entry) return tile;
  tile.vouched = entry->vouches_for(text_of(tile.bytes)) ? Vouched::yes : Vouched::other_bytes;
  if (tile.vouched == Vouched::yes) tile.facts = entry->facts;
  return tile;
}

Result<Bytes> PmtilesStore::read(TileId id) const {
  auto tile = look_at(id);
  if (!tile) return std::unexpected(tile.error());
  if (tile->vouched == Vouched::by_nobody || tile->vouched == Vouched::yes)
    return std::move(tile->bytes);
  return fail(Errc::io, tile_name(id) +
                            " is not as it was written: the file is damaged; tind verify says "
                            "more, and mends it");
}

/// In the order of the file. `left`: so many more may come.
Result<void> PmtilesStore::each_entry(const Directory& entries, int depth, std::uint64_t& left,
                                      const std::function<void(const PmtilesEntry&)>& take) const {
  for (const PmtilesEntry& e : entries) {
    if (e.run > 1)
      return fail(Errc::unsupported, path_ + " has one tile in many places, which no terrain has");
    if (left-- == 0) return damaged("its directories name more tiles than it has bytes");
    if (e.run == 1) {
      take(e);
      continue;
    }
    if (depth + 1 >= kDeepestLeaf) return damaged("its directories go too deep");
    const auto inside = leaf(e);
    if (!inside) return std::unexpected(inside.error());
    if (auto done = each_entry(**inside, depth + 1, left, take); !done) return done;
  }
  return {};
}

Result<std::optional<StoreListing>> PmtilesStore::list() const {
  if (!head_) return std::unexpected(head_.error());
  StoreListing listing;
  const auto take = [&](const PmtilesEntry& e) {
    const auto place = proto::pmtiles_place(e.number);
    const auto id = place ? tile_of(*place) : std::nullopt;
    if (!id) return listing.strays.push_back("tile number " + std::to_string(e.number));
    if (listing.levels.size() <= std::size_t(id->level)) listing.levels.resize(id->level + 1u);
    listing.levels[std::size_t(id->level)].push_back(*id);
  };
  std::uint64_t most = head_->header.tiles.size + head_->root.size();
  if (auto done = each_entry(head_->root, 0, most, take); !done)
    return std::unexpected(done.error());
  for (auto& level : listing.levels) {
    std::ranges::sort(level);
    const auto twice = std::ranges::unique(level);
    level.erase(twice.begin(), twice.end());
  }
  std::ranges::sort(listing.strays);
  return listing;
}

/// Everything that no tile's own entry stands for.
std::vector<StoreFault> PmtilesStore::faults() const {
  std::vector<StoreFault> faults;
  const auto found = [&](const std::string& what) {
    faults.push_back({StoreFault::In::ledger, path_, what});
  };
  if (!head_) return found(head_.error().what), faults;
  if (!head_->seal) return faults;
  const Seal& s = *head_->seal;
  std::uint64_t hash = 0, end = 0, count = 0;
  const PmtilesSection &leaves = head_->header.leaves, all = entries_section();
  const auto directories = (*file_)->read(leaves);
  if (!directories || hash64(*directories) != s.leaves_hash) found("its directories are damaged");
  bool in_order = true;
  std::uint64_t most = 2 * s.tiles + head_->root.size();
  const auto listed = each_entry(head_->root, 0, most, [&](const PmtilesEntry& e) {
    in_order &= e.at == end;
    end = e.at + e.size, ++count;
  });
  if (!listed || !in_order || count != s.tiles || end != s.entries_at)
    found("its directories do not name the tiles one behind the other");
  for (std::uint64_t at = 0; at < all.size; at += kAtOnce) {
    const auto part =
        (*file_)->read({all.at + at, std::min<std::uint64_t>(kAtOnce, all.size - at)});
    if (!part) {
      found(part.error().what);
      break;
    }
    for (std::size_t k = 0; k < part->size(); k += kLedgerPlace)
      hash = hash64(text_of(*part).substr(k, kLedgerPlace), hash);
  }
  if (hash != s.entries_hash) found("its entries of tiles are damaged");
  if (const auto blocks = kept_blocks(); !blocks && s.blocks_size > 0)
    faults.push_back({StoreFault::In::blocks, path_, "its hashes of blocks are damaged"});
  return faults;
}

}  // namespace

std::unique_ptr<TileStore> pmtiles_store(const std::string& file) {
  return std::make_unique<PmtilesStore>(file);
}

}  // namespace tind
