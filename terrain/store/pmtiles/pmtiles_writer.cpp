// Directories stand before the tiles and tell their sizes. So tiles and their entries are written
// to files without names first, which end with the process; at the end they are copied behind the
// directories.

#include "terrain/store/pmtiles/pmtiles_writer.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "proto/json_text.h"
#include "terrain/base/deflate.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/hash.h"
#include "terrain/base/whole_io.h"
#include "terrain/store/ledger_entry.h"
#include "terrain/store/part_file.h"
#include "terrain/store/pmtiles/pmtiles_seal.h"

namespace tind {

namespace {

using namespace pmtiles;
using proto::PmtilesEntry;
using proto::PmtilesHeader;

constexpr int kLevel = 10;                   // of DEFLATE, of the metadata
constexpr std::size_t kBuffered = 4u << 20;  // bytes
constexpr std::size_t kCopied = 8u << 20;    // at once

/// Bytes on their way, in a file without a name.
class Spool {
 public:
  static Result<Spool> beside(const std::string& path) {
    const std::string parent = std::filesystem::path(path).parent_path().string();
    const std::string folder = parent.empty() ? "." : parent;
    int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (file < 0) {  // not every file system can
      std::string name = path + ".XXXXXX";
      file = ::mkostemp(name.data(), O_CLOEXEC);
      if (file >= 0) ::unlink(name.c_str());
    }
    if (file < 0) return fail(Errc::io, "cannot write in " + folder + ": " + errno_text(errno));
    return Spool(file, folder);
  }
  Spool(Spool&& other) noexcept
      : file_(std::exchange(other.file_, -1)),
        size_(other.size_),
        buffer_(std::move(other.buffer_)),
        folder_(std::move(other.folder_)) {}
  Spool& operator=(Spool&&) = delete;
  ~Spool() {
    if (file_ >= 0) ::close(file_);
  }

  std::uint64_t size() const { return size_ + buffer_.size(); }
  Result<void> append(std::string_view bytes) {
    buffer_ += bytes;
    return buffer_.size() < kBuffered ? Result<void>{} : flush();
  }
  /// All of it, to where it belongs.
  Result<void> copy_to(PartFile& to, std::uint64_t at) {
    if (auto done = flush(); !done) return done;
    std::string part;
    for (std::uint64_t from = 0; from < size_; from += part.size()) {
      part.resize(std::size_t(std::min<std::uint64_t>(kCopied, size_ - from)));
      if (!read_whole_at(file_, from, part.data(), part.size()))
        return fail(Errc::io, "cannot read what was written in " + folder_);
      if (auto done = to.write_at(at + from, part); !done) return done;
    }
    return {};
  }

 private:
  Spool(int file, std::string folder) : file_(file), folder_(std::move(folder)) {}
  Result<void> flush() {
    if (auto done = write_all_at(file_, size_, buffer_, "a file in " + folder_); !done) return done;
    size_ += buffer_.size();
    buffer_.clear();
    return {};
  }

  int file_;
  std::uint64_t size_ = 0;
  std::string buffer_, folder_;
};

std::string metadata_of(const ArchiveHead& head) {
  nlohmann::ordered_json j;
  j["name"] = head.layer.name;
  j["description"] = head.layer.description;
  j["attribution"] = head.layer.attribution;
  j["type"] = "baselayer";
  j["version"] = head.layer.version;
  j["format"] = head.layer.format;
  j["projection"] = head.layer.projection;
  j[kSealed] = kVersion;
  j[kLayer] = head.layer_text;
  if (!head.record_text.empty()) j[kRecord] = head.record_text;
  return json::to_text(j);
}

std::int32_t tens_of_millionths(double degrees, double most) {
  return std::int32_t(std::lround(std::clamp(degrees, -most, most) * 1e7));
}

class Writer : public ArchiveWriter {
 public:
  Writer(PartFile part, Spool tiles, Spool places, ArchiveHead head)
      : part_(std::move(part)),
        tiles_(std::move(tiles)),
        places_(std::move(places)),
        head_(std::move(head)),
        seed_(head_.seed()) {}

  void put_in_order(std::vector<TileId>& ids) const override {
    std::ranges::sort(ids, {}, [](TileId id) { return proto::pmtiles_number(place_of(id)); });
  }

  Result<void> add(TileId id, const std::vector<std::uint8_t>& packed, TileFacts facts) override {
    const std::string_view bytes{reinterpret_cast<const char*>(packed.data()), packed.size()};
    LedgerEntry entry{.id = id, .facts = facts};
    entry.take(bytes);
    const std::string place = encode_place(entry, seed_);
    seal_.entries_hash = hash64(place, seal_.entries_hash);
    entries_.push_back(
        {proto::pmtiles_number(place_of(id)), tiles_.size(), std::uint32_t(packed.size()), 1});
    if (auto done = tiles_.append(bytes); !done) return done;
    return places_.append(place);
  }

  Result<void> finish() override;

 private:
  PartFile part_;
  Spool tiles_, places_;
  const ArchiveHead head_;
  const std::uint64_t seed_;
  Seal seal_;
  std::vector<PmtilesEntry> entries_;

  PmtilesHeader header() const;
};

/// Without sections.
PmtilesHeader Writer::header() const {
  PmtilesHeader h;
  h.addressed = h.entries = h.contents = entries_.size();
  h.clustered = true;
  if (!entries_.empty()) {
    h.min_zoom = std::uint8_t(proto::pmtiles_place(entries_.front().number)->zoom);
    h.max_zoom = std::uint8_t(proto::pmtiles_place(entries_.back().number)->zoom);
  }
  const auto& [west, south, east, north] = head_.layer.bounds;
  h.west = tens_of_millionths(west, 180), h.south = tens_of_millionths(south, 90);
  h.east = tens_of_millionths(east, 180), h.north = tens_of_millionths(north, 90);
  h.centre_zoom = h.min_zoom;
  h.centre_lon = tens_of_millionths((west + east) / 2, 180);
  h.centre_lat = tens_of_millionths((south + north) / 2, 90);
  return h;
}

Result<void> Writer::finish() {
  const auto directories = proto::pmtiles_directories(entries_);
  const std::string metadata = deflate<std::string>(metadata_of(head_), Wrapping::gzip, kLevel);
  PmtilesHeader h = header();
  h.root = {proto::kPmtilesHeaderBytes, directories.root.size()};
  h.metadata = {h.root.end(), metadata.size()};
  h.leaves = {h.metadata.end(), directories.leaves.size()};
  const std::uint64_t behind = tiles_.size() + places_.size();
  h.tiles = {h.leaves.end(), behind + head_.blocks.size() + kSealBytes};
  const std::string head = proto::encode_pmtiles_header(h) + directories.root + metadata;
  seal_.tiles = entries_.size();
  seal_.entries_at = tiles_.size();
  seal_.blocks_size = head_.blocks.size(), seal_.blocks_hash = hash64(head_.blocks);
  seal_.head_hash = hash64(head);
  seal_.leaves_hash = hash64(directories.leaves);
  seal_.leaf_entries = directories.leaf_entries;
  if (auto done = part_.write_at(0, head + directories.leaves); !done) return done;
  if (auto done = tiles_.copy_to(part_, h.tiles.at); !done) return done;
  if (auto done = places_.copy_to(part_, h.tiles.at + seal_.entries_at); !done) return done;
  if (auto done = part_.write_at(h.tiles.at + behind, head_.blocks + encode(seal_)); !done)
    return done;
  return part_.finish();
}

}  // namespace

Result<std::unique_ptr<ArchiveWriter>> write_pmtiles(const std::string& file, ArchiveHead head) {
  auto part = PartFile::begin(file, "PMTiles");
  if (!part) return std::unexpected(part.error());
  // Known for ours, should this end before the header is written.
  if (auto done = part->write_at(0, "PMTiles"); !done) return std::unexpected(done.error());
  auto tiles = Spool::beside(part->path()), places = Spool::beside(part->path());
  if (!tiles) return std::unexpected(tiles.error());
  if (!places) return std::unexpected(places.error());
  return std::make_unique<Writer>(std::move(*part), std::move(*tiles), std::move(*places),
                                  std::move(head));
}

}  // namespace tind
