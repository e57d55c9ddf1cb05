// One kind of file, finished or not: a header, then records one after the other, each with its tile
// and a hash. What was begun is therefore read like what is whole, up to the first record that is
// not; a last record without a tile, with the number of the others, says that it is whole.

#include "terrain/pyramid/residual/residual_index.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "terrain/base/errno_text.h"
#include "terrain/base/hash.h"
#include "terrain/base/parallel.h"
#include "terrain/base/whole_io.h"
#include "terrain/geo/availability.h"
#include "terrain/geo/extent_box.h"
#include "terrain/pyramid/residual/residual_scan.h"
#include "terrain/surface/void_fill.h"

namespace tind {

namespace {

constexpr std::array<char, 8> kMagic = {'t', 'i', 'n', 'd', 'R', 'I', 'X', '\n'};
constexpr std::array<char, 8> kPartMagic = {'t', 'i', 'n', 'd', 'R', 'I', 'P', '\n'};
constexpr std::uint32_t kVersion = 4;
/// Of levels that had finer steps than records can hold high ground in.
constexpr std::uint32_t kDeepVersion = 0x1004;
/// Of layers; to be raised with every change of their heights, too (as kLayerEpoch is for tiles).
constexpr std::uint32_t kLayersVersion = 5;
constexpr std::uint32_t kEndLevel = 0xffffffff;
constexpr std::uint32_t kMostBytes = 4 << 20;  // of one record
constexpr int kFinerAlong = 2;                 // levels

struct FileHeader {
  std::array<char, 8> magic = kMagic;
  std::uint32_t version = kVersion, level = 0;
  std::array<char, 32> fingerprint{};
  std::int64_t cols = 0, rows = 0;  // of layers: IndexDepth::most_posts(), and 0
  std::uint64_t hash = 0;           // of what stands before
};
static_assert(sizeof(FileHeader) == 72);

struct RecordHeader {
  std::uint32_t level = 0, x = 0, y = 0, size = 0;
  std::uint64_t hash = 0;      // of the record's bytes; at the end: the number of records
  std::uint64_t own_hash = 0;  // of what stands before
};
static_assert(sizeof(RecordHeader) == 32);

template <class T>
std::uint64_t hash_before(const T& header) {
  return hash64({&header, sizeof(T) - sizeof(std::uint64_t)});
}

FileHeader header_for(const Surface& surface, const IndexDepth& depth) {
  FileHeader h;
  h.level = std::uint32_t(depth.level());
  const DemInfo& info = surface.info();
  std::copy_n(info.fingerprint.begin(), std::min(info.fingerprint.size(), h.fingerprint.size()),
              h.fingerprint.begin());
  h.cols = info.cols, h.rows = info.rows;
  if (surface.only() && depth.has_least_step()) h.version = kDeepVersion;
  if (!surface.only()) h.version = kLayersVersion, h.cols = depth.most_posts();
  h.hash = hash_before(h);
  return h;
}

/// Machines agree on whose heights they are, not on what a source says of its files.
FileHeader header_of_part(const IndexPart& part, const IndexDepth& depth) {
  FileHeader h;
  h.magic = kPartMagic;
  h.level = std::uint32_t(depth.level());
  std::copy_n(part.whose.begin(), std::min(part.whose.size(), h.fingerprint.size()),
              h.fingerprint.begin());
  h.hash = hash_before(h);
  return h;
}

Result<void> write_at(int file, const std::string& path, std::uint64_t at, const void* from,
                      std::size_t size) {
  const int code = write_whole_at(file, at, {static_cast<const char*>(from), size});
  if (code != 0) return fail(Errc::io, path + ": cannot be written: " + errno_text(code));
  return {};
}

/// Tiles of a level that hold a post, or touch one with a side; of one DEM those, too, in which
/// what fills its surroundings is not 0.
TileArea touched_area(const Surface& surface, int level) {
  const DemInfo& info = surface.info();
  const double side = tiling::tile_degrees(level);
  const auto index = [&](double degrees, std::uint32_t count, double hair) {
    return std::uint32_t(std::clamp(std::floor(degrees / side + hair), 0.0, double(count - 1)));
  };
  constexpr double kHair = 1e-9;
  const std::uint32_t columns = tiling::columns(level), rows = tiling::rows(level);
  std::vector<TileRange> ranges;
  for (GeoRect b : info.extents.empty() ? std::vector{info.bounds} : info.extents) {
    if (surface.only())  // (past the antimeridian a record is done without)
      b = grown(b, (VoidFill::kReach + 2) * std::max(info.spacing_x_m, info.spacing_y_m));
    ranges.push_back({index(b.west + 180, columns, -kHair), index(b.south + 90, rows, -kHair),
                      index(b.east + 180, columns, kHair), index(b.north + 90, rows, kHair)});
  }
  return TileArea(std::move(ranges));
}

/// Those of a level that the index has records of.
std::vector<TileId> tiles_of(const Surface& surface, const IndexDepth& depth, int level) {
  const TileArea touched = touched_area(surface, level);
  std::vector<TileId> ids;
  if (surface.only() || level == 0) {
    for (std::uint64_t i = 0; i < touched.size(); ++i)
      ids.push_back({level, touched[i].first, touched[i].second});
    return ids;
  }
  for (const TileId parent : depth.tiles()) {
    if (parent.level != level - 1) continue;
    for (int part = 0; part < 4; ++part)
      if (const TileId id = parent.child(part % 2, part / 2); touched.contains(id.x, id.y))
        ids.push_back(id);
  }
  return ids;
}

/// Records in the order in which they are to be written, however they come.
class InOrder {
 public:
  using Bytes = std::vector<std::uint8_t>;
  explicit InOrder(std::function<Result<void>(std::size_t, const Bytes&)> write)
      : write_(std::move(write)) {}
  Result<void> take(std::size_t i, Bytes bytes) {
    const std::lock_guard lock(mutex_);
    waiting_.emplace(i, std::move(bytes));
    for (auto it = waiting_.begin(); it != waiting_.end() && it->first == next_;
         it = waiting_.erase(it), ++next_)
      if (auto done = write_(it->first, it->second); !done) return done;
    return {};
  }

 private:
  const std::function<Result<void>(std::size_t, const Bytes&)> write_;
  std::mutex mutex_;
  std::map<std::size_t, Bytes> waiting_;
  std::size_t next_ = 0;
};

}  // namespace

std::vector<TileId> scanned_tiles(const Surface& surface, const IndexDepth& depth) {
  std::vector<TileId> ids;
  for (int z = depth.level(); z >= 0; --z)
    for (const TileId id : tiles_of(surface, depth, z))
      if (!depth.serves(id)) ids.push_back(id);
  return ids;
}

/// The file while it is looked through or written.
class ResidualFile {
 public:
  using Index = ResidualIndex;

  static std::shared_ptr<Index> blank(const std::string& path, const IndexDepth& depth) {
    std::shared_ptr<Index> index(new Index(depth));
    index->path_ = path;
    return index;
  }

  /// A pipe of that name would keep who opens it.
  static Result<void> open_file(Index& index) {
    index.file_ = ::open(index.path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat status {};
    if (index.file_ < 0 || ::fstat(index.file_, &status) != 0)
      return fail(errno == ENOENT ? Errc::not_found : Errc::io,
                  index.path_ + ": " + errno_text(errno));
    if (!S_ISREG(status.st_mode)) return fail(Errc::bad_data, index.path_ + ": is no file");
    return {};
  }

  /// Takes in all whole records; where they end, and whether the file says that they are all.
  struct Walked {
    std::uint64_t end = 0;
    bool whole = false;
  };
  static Result<Walked> walk(Index& index, const FileHeader& wanted, int threads) {
    FileHeader found;
    struct stat status {};
    if (::fstat(index.file_, &status) != 0)
      return fail(Errc::io, index.path_ + ": " + errno_text(errno));
    const auto size = std::uint64_t(status.st_size);
    const auto begins = read_at(index, 0, &found, sizeof found);
    if (!begins) return std::unexpected(begins.error());
    if (!*begins || std::memcmp(&found, &wanted, sizeof found) != 0)
      return fail(Errc::bad_data, index.path_ + ": not an index of this source as it is now");
    Walked walked{sizeof found, false};
    std::vector<std::pair<TileId, Index::Place>> records;
    RecordHeader header;
    while (!walked.whole && size - walked.end >= sizeof header) {
      const auto goes_on = read_at(index, walked.end, &header, sizeof header);
      if (!goes_on) return std::unexpected(goes_on.error());
      if (!*goes_on || hash_before(header) != header.own_hash) break;
      if (header.level == kEndLevel) {
        walked.whole = header.hash == records.size() && walked.end + sizeof header == size;
        break;
      }
      const auto id = tiling::tile(header.level, header.x, header.y);
      if (!id || id->level > index.level() || header.size > kMostBytes) break;
      if (size - walked.end - sizeof header < header.size) break;
      records.push_back({*id, {walked.end + sizeof header, header.hash, header.size}});
      walked.end += sizeof header + header.size;
    }
    // The first that is damaged ends what is taken. One that cannot be read may be sound.
    std::vector<Result<bool>> good(records.size(), false);
    parallel_for(records.size(), threads, [&](std::size_t i) {
      std::vector<std::uint8_t> bytes;
      good[i] = read_bytes(index, records[i].second, bytes);
    });
    for (std::size_t i = 0; i < records.size(); ++i) {
      if (!good[i]) return std::unexpected(good[i].error());
      if (!*good[i]) {
        walked = {records[i].second.offset - sizeof header, false};
        break;
      }
      index.places_[records[i].first] = records[i].second;
    }
    return walked;
  }

  /// False where the file ends before.
  static Result<bool> read_at(const Index& index, std::uint64_t at, void* to, std::size_t size) {
    const ReadBytes got = read_up_to(index.file_, at, to, size);
    if (got.error != 0)
      return fail(Errc::io, index.path_ + ": cannot be read: " + errno_text(got.error));
    return got.size == size;
  }

  /// False where they are not sound.
  static Result<bool> read_bytes(const Index& index, const Index::Place& place,
                                 std::vector<std::uint8_t>& bytes) {
    bytes.resize(place.size);
    const auto all = read_at(index, place.offset, bytes.data(), bytes.size());
    if (!all) return all;
    return *all && hash64(bytes) == place.hash;
  }

  static bool has_just(const Index& index, const std::vector<TileId>& ids) {
    return index.places_.size() == ids.size() &&
           std::ranges::all_of(ids, [&](TileId id) { return index.places_.contains(id); });
  }

  /// The facts that the roots hold. Fails when a root is not there.
  static Result<void> sum_up(Index& index, const Surface& surface) {
    index.min_m_ = HUGE_VAL, index.max_m_ = -HUGE_VAL;
    index.posts_ = 0;
    for (const TileId id : tiles_of(surface, index.depth(), 0)) {
      const auto root = index.head(id);
      if (!root) return std::unexpected(root.error());
      const ResidualFacts& r = **root;
      if (!r.has_posts()) continue;
      index.min_m_ = std::min<double>(index.min_m_, r.min_m);
      index.max_m_ = std::max<double>(index.max_m_, r.max_m);
      index.posts_ += r.posts();
    }
    if (index.posts_ == 0) index.min_m_ = index.max_m_ = 0;
    struct stat status {};
    ::fstat(index.file_, &status);
    index.bytes_ = std::uint64_t(status.st_size);
    return {};
  }

  ResidualFile(Surface surface, std::shared_ptr<Index> index)
      : surface_(std::move(surface)), index_(std::move(index)), step_(index_->depth().step_m()) {}

  /// Which records there are elsewhere. One that cannot be used is not there.
  void know(std::span<const IndexPart> parts, int threads) {
    for (const IndexPart& part : parts) {
      const auto there = open_part(part, index_->depth(), threads);
      if (!there) continue;
      for (const auto& [id, place] : (*there)->places_)
        made_.emplace(id, std::pair{part.path, place});
    }
  }

  static Result<std::shared_ptr<Index>> open_part(const IndexPart& part, const IndexDepth& depth,
                                                  int threads) {
    auto index = blank(part.path, depth);
    if (auto opened = open_file(*index); !opened) return std::unexpected(opened.error());
    const auto walked = walk(*index, header_of_part(part, depth), threads);
    if (!walked) return std::unexpected(walked.error());
    if (!walked->whole) return fail(Errc::bad_data, part.path + ": damaged, or not finished");
    return index;
  }

  /// A file of these records alone, straight from the posts.
  Result<void> make_part(const FileHeader& header, const std::vector<TileId>& ids, int threads,
                         const Progress& progress) {
    if (auto done = begin(header); !done) return done;
    to_scan_ = ids.size();
    if (auto done = level(ids, threads, progress); !done) return done;
    return end();
  }

  Result<void> make(int threads, const Progress& progress) {
    const FileHeader header = header_for(surface_, index_->depth());
    auto begun = walk(*index_, header, threads);
    if (!begun && begun.error().code == Errc::io) return std::unexpected(begun.error());
    if (begun && begun->whole) return {};
    if (begun) {
      end_ = begun->end;
    } else if (auto done = this->begin(header); !done) {
      return done;
    }
    if (::ftruncate(index_->file_, off_t(end_)) != 0)
      return fail(Errc::io, index_->path_ + ": " + errno_text(errno));
    std::vector<std::vector<TileId>> levels;
    for (int z = 0; z <= index_->level(); ++z) {
      levels.push_back(tiles_of(surface_, index_->depth(), z));
      for (const TileId id : levels.back()) {
        const bool scanned = !index_->depth().serves(id) && !made_.contains(id);
        to_scan_ += scanned, scanned_ += scanned && index_->places_.contains(id);
      }
    }
    for (int z = index_->level(); z >= 0; --z)
      if (auto done = level(levels[std::size_t(z)], threads, progress); !done) return done;
    return end();
  }

 private:
  const Surface surface_;
  const std::shared_ptr<Index> index_;
  const double step_;
  std::uint64_t end_ = 0;
  std::size_t scanned_ = 0, to_scan_ = 0;                        // tiles whose posts are read
  std::map<TileId, std::pair<std::string, Index::Place>> made_;  // elsewhere: in which file
  std::mutex mutex_;

  Result<void> begin(const FileHeader& header) {
    index_->places_.clear();
    end_ = sizeof header;
    return write_at(index_->file_, index_->path_, 0, &header, sizeof header);
  }
  Result<void> end() {
    RecordHeader last;
    last.level = kEndLevel;
    last.hash = index_->places_.size();
    last.own_hash = hash_before(last);
    return write_at(index_->file_, index_->path_, end_, &last, sizeof last);
  }

  /// The bytes of a record that a part has; nothing where it has been damaged since.
  std::optional<std::vector<std::uint8_t>> made_elsewhere(TileId id) const {
    const auto found = made_.find(id);
    if (found == made_.end()) return {};
    const auto& [path, place] = found->second;
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0) return {};
    std::vector<std::uint8_t> bytes(place.size);
    const bool good = read_whole_at(file, place.offset, bytes.data(), bytes.size());
    ::close(file);
    if (!good || hash64(bytes) != place.hash || !decode_record(bytes)) return {};
    return bytes;
  }

  /// Records of tiles of one level, where they are not there yet. REQUIRES: those of the next.
  Result<void> level(const std::vector<TileId>& all, int threads, const Progress& progress) {
    std::vector<TileId> ids;
    for (const TileId id : all)
      if (!index_->places_.contains(id)) ids.push_back(id);
    std::optional<Error> error;
    InOrder records([&](std::size_t i, const auto& bytes) { return append(ids[i], bytes); });
    parallel_for(ids.size(), threads, [&](std::size_t i) {
      {
        const std::lock_guard lock(mutex_);
        if (error || progress.stopped()) return;
      }
      const bool joined = index_->depth().serves(ids[i]);
      auto bytes = made_elsewhere(ids[i]);
      const bool made = bytes.has_value();
      std::optional<Error> wrong;
      if (!made) {
        auto record =
            joined ? from_children(ids[i]) : scan_residuals(surface_, ids[i], step_, progress.stop);
        if (record)
          bytes = encode(*record);
        else
          wrong = record.error();
      }
      if (bytes)
        if (auto written = records.take(i, std::move(*bytes)); !written) wrong = written.error();
      const std::lock_guard lock(mutex_);
      if (!error && wrong) error = std::move(wrong);
      // Reading the posts is nearly all of it.
      if (!joined && !made)
        progress.at(0.97 *
                    std::min(1.0, double(++scanned_) / double(std::max<std::size_t>(1, to_scan_))));
    });
    if (error) return std::unexpected(*error);
    if (progress.stopped()) return fail(Errc::cancelled, "stopped; run the same command to go on");
    return {};
  }

  Result<ResidualRecord> from_children(TileId id) {
    std::array<ResidualRecord, 4> records;
    std::array<const ResidualRecord*, 4> children{};
    for (std::size_t i = 0; i < 4; ++i) {
      const TileId child = id.child(i % 2 == 1, i >= 2);
      std::unique_lock lock(mutex_);
      const auto found = index_->places_.find(child);
      if (found == index_->places_.end()) continue;  // the source does not touch it
      const Index::Place place = found->second;
      lock.unlock();
      auto record = index_->record_at(child, place);
      if (!record) return record;
      records[i] = std::move(*record);
      children[i] = &records[i];
    }
    return join(children, step_);
  }

  Result<void> append(TileId id, const std::vector<std::uint8_t>& bytes) {
    RecordHeader header{std::uint32_t(id.level),     id.x,          id.y,
                        std::uint32_t(bytes.size()), hash64(bytes), 0};
    header.own_hash = hash_before(header);
    std::vector<std::uint8_t> whole(sizeof header + bytes.size());
    std::memcpy(whole.data(), &header, sizeof header);
    std::memcpy(whole.data() + sizeof header, bytes.data(), bytes.size());
    const std::lock_guard lock(mutex_);
    auto done = write_at(index_->file_, index_->path_, end_, whole.data(), whole.size());
    if (!done) return done;
    index_->places_[id] = {end_ + sizeof header, header.hash, header.size};
    end_ += whole.size();
    return {};
  }
};

ResidualIndex::~ResidualIndex() {
  if (file_ >= 0) ::close(file_);
}

Result<std::shared_ptr<const ResidualIndex>> ResidualIndex::open(const std::string& path,
                                                                 const Surface& surface,
                                                                 const IndexDepth& depth) {
  auto index = ResidualFile::blank(path, depth);
  if (auto opened = ResidualFile::open_file(*index); !opened)
    return std::unexpected(opened.error());
  const auto walked = ResidualFile::walk(*index, header_for(surface, depth), 0);
  if (!walked) return std::unexpected(walked.error());
  if (!walked->whole) return fail(Errc::bad_data, path + ": damaged, or not finished");
  if (auto done = ResidualFile::sum_up(*index, surface); !done)
    return std::unexpected(done.error());
  return index;
}

Result<std::shared_ptr<const ResidualIndex>> ResidualIndex::open_or_make(
    const std::string& path, const Surface& surface, const IndexDepth& depth, int threads,
    const Progress& progress, std::span<const IndexPart> parts) {
  // One that cannot be read may be sound, and took hours.
  if (auto there = open(path, surface, depth); there || there.error().code == Errc::io)
    return there;
  const std::string part = path + ".part";
  auto index = ResidualFile::blank(part, depth);
  index->file_ = ::open(part.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (index->file_ < 0) return fail(Errc::io, part + ": " + errno_text(errno));
  while (::flock(index->file_, LOCK_EX | LOCK_NB) != 0) {  // another process is at it
    if (progress.stopped()) return fail(Errc::cancelled, "stopped");
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  if (auto there = open(path, surface, depth)) {  // it was
    ::unlink(part.c_str());
    return there;
  }
  ResidualFile file(surface, index);
  file.know(parts, threads);
  if (auto made = file.make(threads, progress); !made) return std::unexpected(made.error());
  if (::fsync(index->file_) != 0 || ::rename(part.c_str(), path.c_str()) != 0)
    return fail(Errc::io, path + ": cannot be written: " + errno_text(errno));
  ::flock(index->file_, LOCK_UN);  // others may be waiting, and the file stays open
  index->path_ = path;
  index->made_now_ = true;
  if (auto done = ResidualFile::sum_up(*index, surface); !done)
    return std::unexpected(done.error());
  progress.at(1);
  return index;
}

Result<void> make_index_part(const IndexPart& part, const std::string& unfinished_path,
                             const Surface& surface, const IndexDepth& depth,
                             const std::vector<TileId>& ids, int threads,
                             const Progress& progress) {
  if (const auto there = ResidualFile::open_part(part, depth, threads);
      there && ResidualFile::has_just(**there, ids))
    return {};
  auto index = ResidualFile::blank(unfinished_path, depth);
  index->file_ =
      ::open(unfinished_path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (index->file_ < 0) return fail(Errc::io, unfinished_path + ": " + errno_text(errno));
  auto made =
      ResidualFile(surface, index).make_part(header_of_part(part, depth), ids, threads, progress);
  if (made &&
      (::fsync(index->file_) != 0 || ::rename(unfinished_path.c_str(), part.path.c_str()) != 0))
    made = fail(Errc::io, part.path + ": cannot be written: " + errno_text(errno));
  if (!made) ::unlink(unfinished_path.c_str());
  return made;
}

template <class T>
Result<std::shared_ptr<const T>> ResidualIndex::kept_or_read(
    Lru<TileId, std::shared_ptr<const T>>& kept, TileId id,
    Result<T> (ResidualIndex::*read)(TileId, const Place&) const) const {
  const auto place = places_.find(id);
  if (place == places_.end()) return fail(Errc::not_found, path_ + ": has no tile " + id.text());
  {
    const std::lock_guard lock(mutex_);
    if (const auto* const there = kept.find(id)) return *there;
  }
  auto made = (this->*read)(id, place->second);
  if (!made) return std::unexpected(made.error());
  auto shared = std::make_shared<const T>(std::move(*made));
  const std::lock_guard lock(mutex_);
  kept.insert(id, shared);
  return shared;
}

Result<std::shared_ptr<const ResidualRecord>> ResidualIndex::record(TileId id) const {
  return kept_or_read(kept_, id, &ResidualIndex::record_at);
}

Result<std::shared_ptr<const ResidualHead>> ResidualIndex::head(TileId id) const {
  return kept_or_read(heads_, id, &ResidualIndex::head_at);
}

Result<ResidualHead> ResidualIndex::head_at(TileId id, const Place& place) const {
  std::array<std::uint8_t, kMostHeadBytes> buffer;
  const std::span bytes(buffer.data(), std::min<std::size_t>(place.size, buffer.size()));
  const auto all = ResidualFile::read_at(*this, place.offset, bytes.data(), bytes.size());
  if (!all) return std::unexpected(all.error());
  if (!*all) return std::unexpected(damaged(id));
  auto head = decode_head(bytes);
  if (!head) return fail(damaged(id).what, head.error());
  return head;
}

int ResidualIndex::finer(int level) const { return std::min(kFinerAlong, depth_.level() - level); }

Result<ResidualRecord> ResidualIndex::record_at(TileId id, const Place& place) const {
  std::vector<std::uint8_t> bytes;
  const auto sound = ResidualFile::read_bytes(*this, place, bytes);
  if (!sound) return std::unexpected(sound.error());
  if (!*sound) return std::unexpected(damaged(id));
  auto record = decode_record(bytes);
  if (!record) return fail(damaged(id).what, record.error());
  return record;
}

Error ResidualIndex::damaged(TileId id) const {
  return {Errc::bad_data,
          path_ + ": damaged at tile " + id.text() + " (start again: it is then made anew)"};
}

int ResidualIndex::lattice_level(int level, Geographic place) const {
  if (level >= depth_.level()) return -1;
  if (depth_.tiles().empty()) return level + 1;
  // A place on a line is in the tile to its north-east, whoever asks.
  const double side = tiling::tile_degrees(level);
  const auto number = [&](double degrees, std::uint32_t count) {
    return std::min(count - 1, std::uint32_t(std::max(0.0, degrees / side)));
  };
  const TileId id{level, number(place.lon + 180, tiling::columns(level)),
                  number(place.lat + 90, tiling::rows(level))};
  return serves(id) ? level + 1 : -1;
}

Result<ResidualLattice> ResidualIndex::lattice(TileId id) const {
  const auto own = head(id);
  if (!own) return std::unexpected(own.error());
  const int down = depth_.serves(id) ? 1 : 0, side = 1 << down;
  std::vector<std::shared_ptr<const ResidualRecord>> records(std::size_t(side) * std::size_t(side));
  std::vector<const ResidualRecord*> parts(records.size());
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const TileId part{id.level + down, (id.x << down) + std::uint32_t(k) % side,
                      (id.y << down) + std::uint32_t(side - 1) - std::uint32_t(k) / side};
    if (!places_.contains(part)) continue;  // the source does not touch it
    auto found = record(part);
    if (!found) return std::unexpected(found.error());
    records[k] = std::move(*found);
    parts[k] = records[k].get();
  }
  ResidualLattice lattice = lattice_of(parts, depth_.step_m());
  lattice.min_m = (*own)->min_m;
  lattice.max_m = (*own)->max_m;
  lattice.posts = (*own)->posts();
  return lattice;
}

}  // namespace tind
