// A magic with the seed; then for each tile its entry, as ledgers have it, and its bytes.

#include "terrain/pyramid/shards/shard_spool.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <utility>

#include "terrain/base/bytes.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/same_file.h"
#include "terrain/base/whole_io.h"
#include "terrain/store/ledger_entry.h"
#include "terrain/store/part_file.h"

namespace tind {

namespace {

constexpr std::string_view kMagic = "tindSPL1";

std::unexpected<Error> failed(const std::string& what, const std::string& path) {
  return fail(Errc::io, "cannot " + what + " " + path + ": " + errno_text(errno));
}

/// A file of this name that nobody else has; -1 where somebody has it, or one cannot tell.
int take_file(const std::string& path) {
  for (;;) {
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (file < 0) return -1;
    if (::flock(file, LOCK_EX | LOCK_NB) != 0) {
      ::close(file);
      return -1;
    }
    struct stat status {};
    const bool is_file = ::fstat(file, &status) == 0 && S_ISREG(status.st_mode);  // or else foreign
    const auto still = is_still_at(file, path);
    if (is_file && still && *still) return file;
    ::close(file);
    if (!is_file || !still) return -1;  // else whoever had it has finished and removed it
  }
}

}  // namespace

Result<ShardSpool> ShardSpool::open(const std::string& path, std::uint64_t seed,
                                    std::span<const TileId> ids) {
  if (const int file = take_file(path); file >= 0) {
    ShardSpool spool(file, path, seed, ids);
    if (auto done = spool.look(); !done) return std::unexpected(done.error());
    return spool;
  }
  std::string name = path + ".XXXXXX";
  const int file = ::mkostemp(name.data(), O_CLOEXEC);
  if (file < 0) return failed("create a file beside", path);
  ::unlink(name.c_str());
  ShardSpool spool(file, "", seed, ids);
  if (auto done = spool.look(); !done) return std::unexpected(done.error());
  return spool;
}

ShardSpool::ShardSpool(ShardSpool&& other) noexcept
    : file_(std::exchange(other.file_, -1)),
      path_(std::move(other.path_)),
      seed_(other.seed_),
      ids_(other.ids_),
      places_(std::move(other.places_)),
      end_(other.end_) {}

ShardSpool::~ShardSpool() {
  if (file_ >= 0) ::close(file_);
}

Result<void> ShardSpool::look() {
  std::string head(kMagic);
  ByteWriter(head).put(seed_);
  std::string found(head.size(), '\0');
  if (!read_whole_at(file_, 0, found.data(), found.size()) || found != head) {
    if (::ftruncate(file_, 0) != 0) return failed("write", path_);
    end_ = head.size();
    return write_all_at(file_, 0, head, path_);
  }
  end_ = head.size();
  std::string entry(kLedgerPlace, '\0'), bytes;
  for (const TileId id : ids_) {
    if (!read_whole_at(file_, end_, entry.data(), entry.size())) break;
    const auto place = decode_place(entry, id, seed_);
    if (!place || place->facts.size > kLargestStored) break;
    bytes.resize(std::size_t(place->facts.size));
    if (!read_whole_at(file_, end_ + kLedgerPlace, bytes.data(), bytes.size())) break;
    if (!place->vouches_for(bytes)) break;
    places_.push_back({end_ + kLedgerPlace, place->facts});
    end_ += kLedgerPlace + bytes.size();
  }
  if (::ftruncate(file_, off_t(end_)) != 0) return failed("write", path_);
  return {};
}

Result<void> ShardSpool::append(const std::vector<std::uint8_t>& packed, TileFacts facts) {
  const std::string_view bytes{reinterpret_cast<const char*>(packed.data()), packed.size()};
  LedgerEntry entry{.id = ids_[places_.size()], .facts = facts};
  entry.take(bytes);
  std::string all = encode_place(entry, seed_);
  all += bytes;
  if (auto done = write_all_at(file_, end_, all, path_); !done) return done;
  places_.push_back({end_ + kLedgerPlace, entry.facts});
  end_ += all.size();
  return {};
}

Result<std::vector<std::uint8_t>> ShardSpool::read(std::size_t k) const {
  std::vector<std::uint8_t> bytes(std::size_t(places_[k].facts.size));
  if (!read_whole_at(file_, places_[k].at, bytes.data(), bytes.size()))
    return fail(Errc::io, "cannot read what was written to " + path_);
  return bytes;
}

Result<void> ShardSpool::sync() {
  if (::fdatasync(file_) != 0) return failed("write", path_);
  return {};
}

void ShardSpool::remove() {
  if (!path_.empty()) ::unlink(path_.c_str());
}

}  // namespace tind
