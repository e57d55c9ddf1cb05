// A head (what it belongs to, and the ranges of tiles), then a place for each tile.
// Checksums of entries are seeded with the record's hash: an entry that an older ledger left on the
// disk, or one in another tile's place, is not sound.

#include "terrain/store/folder/tile_ledger.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <utility>

#include "terrain/base/errno_text.h"
#include "terrain/base/hash.h"
#include "terrain/base/whole_io.h"
#include "terrain/store/layer_place.h"

namespace tind {

namespace {

constexpr std::array<char, 8> kMagic = {'t', 'i', 'n', 'd', 'T', 'L', 'G', '\n'};
constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kMostRanges = 1 << 24;

struct Head {
  std::array<char, 8> magic = kMagic;
  std::uint32_t version = kVersion, ranges = 0;
  std::uint64_t record = 0;  // XXH3 of the record's text
  std::uint64_t hash = 0;    // of what stands before and the ranges
};
static_assert(sizeof(Head) == 32);

struct Range {
  std::uint32_t level = 0, start_x = 0, start_y = 0, end_x = 0, end_y = 0;
};
static_assert(sizeof(Range) == 20);

std::uint64_t tiles_of(const proto::TileRange& r) {
  return (std::uint64_t(r.end_x) - r.start_x + 1) * (std::uint64_t(r.end_y) - r.start_y + 1);
}

std::uint64_t hash_of(const Head& head, const std::vector<Range>& ranges) {
  const std::uint64_t seed = hash64({&head, offsetof(Head, hash)});
  return hash64({ranges.data(), ranges.size() * sizeof(Range)}, seed);
}

/// Places do not lie across two sectors of a disk.
std::uint64_t begin_of(std::uint64_t ranges) {
  return (sizeof(Head) + ranges * sizeof(Range) + kLedgerPlace - 1) / kLedgerPlace * kLedgerPlace;
}

}  // namespace

std::string TileLedger::blank(std::string_view record, const Levels& levels) {
  std::vector<Range> ranges;
  for (std::size_t z = 0; z < levels.size(); ++z)
    for (const proto::TileRange& r : levels[z])
      ranges.push_back({std::uint32_t(z), r.start_x, r.start_y, r.end_x, r.end_y});
  Head head;
  head.ranges = std::uint32_t(ranges.size());
  head.record = hash64(record);
  head.hash = hash_of(head, ranges);
  std::string out(reinterpret_cast<const char*>(&head), sizeof head);
  out.append(reinterpret_cast<const char*>(ranges.data()), ranges.size() * sizeof(Range));
  out.resize(begin_of(ranges.size()));
  return out;
}

Result<TileLedger> TileLedger::open(const std::string& path) {
  TileLedger ledger;
  // A pipe in its place must not keep us waiting.
  ledger.file_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (ledger.file_ < 0)
    return fail(errno == ENOENT ? Errc::not_found : Errc::io, path + ": " + errno_text(errno));
  if (auto whole = ledger.read_head(path); !whole) return std::unexpected(whole.error());
  return ledger;
}

/// A file that has no name: entries are found in it as in any other.
Result<TileLedger> TileLedger::of_bytes(std::string_view bytes, const std::string& name) {
  TileLedger ledger;
  ledger.file_ = ::memfd_create("ledger", MFD_CLOEXEC);
  const int code = ledger.file_ < 0 ? errno : write_whole_at(ledger.file_, 0, bytes);
  if (code != 0) return fail(Errc::io, name + ": no memory for it: " + errno_text(code));
  if (auto whole = ledger.read_head(name); !whole) return std::unexpected(whole.error());
  return ledger;
}

Result<void> TileLedger::read_head(const std::string& name) {
  const auto damaged = [&] { return fail(Errc::bad_data, name + " is damaged"); };
  const auto unreadable = [&](int code) { return fail(Errc::io, name + ": " + errno_text(code)); };
  struct stat status {};
  if (::fstat(file_, &status) != 0) return unreadable(errno);
  if (!S_ISREG(status.st_mode)) return damaged();
  Head head;
  const auto got = read_up_to(file_, 0, &head, sizeof head);
  if (got.error != 0) return unreadable(got.error);
  if (got.size < sizeof head || head.magic != kMagic || head.ranges > kMostRanges ||
      std::uint64_t(status.st_size) < sizeof head + head.ranges * sizeof(Range))
    return damaged();
  if (head.version != kVersion)
    return fail(Errc::unsupported, name + " is of another version of tind");
  std::vector<Range> ranges(head.ranges);
  const std::size_t size = ranges.size() * sizeof(Range);
  const auto more = read_up_to(file_, sizeof head, ranges.data(), size);
  if (more.error != 0) return unreadable(more.error);
  if (more.size < size || hash_of(head, ranges) != head.hash) return damaged();
  seed_ = head.record;
  begin_ = begin_of(ranges.size());
  std::uint64_t tiles = 0;
  for (const Range& r : ranges) {
    if (!tiling::tile(r.level, r.start_x, r.start_y) || !tiling::tile(r.level, r.end_x, r.end_y) ||
        r.end_x < r.start_x || r.end_y < r.start_y)
      return damaged();
    if (levels_.size() <= r.level) {
      levels_.resize(r.level + 1);
      first_.resize(r.level + 1);
    }
    levels_[r.level].push_back({r.start_x, r.start_y, r.end_x, r.end_y});
    first_[r.level].push_back(tiles);
    tiles += tiles_of(levels_[r.level].back());
  }
  return {};
}

TileLedger::TileLedger(TileLedger&& other) noexcept { *this = std::move(other); }

TileLedger& TileLedger::operator=(TileLedger&& other) noexcept {
  std::swap(file_, other.file_);
  seed_ = other.seed_, begin_ = other.begin_;
  levels_ = std::move(other.levels_), first_ = std::move(other.first_);
  return *this;
}

TileLedger::~TileLedger() {
  if (file_ >= 0) ::close(file_);
}

bool TileLedger::same_tiles(const TileLedger& other) const {
  return begin_ == other.begin_ && first_ == other.first_ && levels_ == other.levels_;
}

Result<void> TileLedger::names_as_many(std::uint64_t listed, const std::string& layer) const {
  std::uint64_t named = 0;  // each once: ranges of other programs may overlap
  for (const auto& level : levels_) named += area_of(level).size();
  if (listed == named) return {};
  return fail(Errc::bad_data,
              layer + " lists " + std::to_string(listed) + " tiles, and the ledger beside it " +
                  std::to_string(named) +
                  ": one of the two is not as it was written; tind verify says more");
}

bool TileLedger::belongs_to(std::string_view record) const { return hash64(record) == seed_; }

std::optional<std::uint64_t> TileLedger::place(TileId id) const {
  if (id.level < 0 || std::size_t(id.level) >= levels_.size()) return {};
  const auto z = std::size_t(id.level);
  for (std::size_t i = 0; i < levels_[z].size(); ++i) {
    const proto::TileRange& r = levels_[z][i];
    if (id.x < r.start_x || id.x > r.end_x || id.y < r.start_y || id.y > r.end_y) continue;
    // From the north, as tiles are made: those of one moment lie side by side.
    const std::uint64_t width = std::uint64_t(r.end_x) - r.start_x + 1;
    return begin_ + kLedgerPlace * (first_[z][i] + (r.end_y - id.y) * width + (id.x - r.start_x));
  }
  return {};
}

Result<std::optional<LedgerEntry>> TileLedger::find(TileId id) const {
  const auto at = place(id);
  if (!at) return std::nullopt;
  std::array<char, kLedgerPlace> bytes;
  const auto got = read_up_to(file_, *at, bytes.data(), bytes.size());
  if (got.error != 0)
    return fail(Errc::io, "the ledger beside the tiles cannot be read: " + errno_text(got.error));
  if (got.size < bytes.size()) return std::nullopt;
  return decode_place({bytes.data(), bytes.size()}, id, seed_);
}

std::string TileLedger::encode(const LedgerEntry& e) const { return encode_place(e, seed_); }

}  // namespace tind
