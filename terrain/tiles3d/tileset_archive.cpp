// Files are read and packed a batch at a time by all threads, and written in their order.

#include "terrain/tiles3d/tileset_archive.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "proto/zip.h"
#include "terrain/base/deflate.h"
#include "terrain/base/file_io.h"
#include "terrain/base/parallel.h"
#include "terrain/store/folder/folder_lock.h"
#include "terrain/store/part_file.h"
#include "terrain/tiles3d/tileset.h"

namespace tind::tiles3d {
namespace {

constexpr const char* kTileset = "tileset.json";
constexpr const char* kBegins = "PK\3\4";
constexpr std::size_t kBatch = 256;               // files
constexpr std::uint64_t kMostBytes = 0xfffffffe;  // of a file
constexpr int kLevel = 6;                         // of DEFLATE

/// What the set names, whatever else lies in its folder; tileset.json comes first.
std::vector<std::string> names_of(const TileSet& set) {
  std::vector<std::string> names;
  each_tile(set, [&](TileId id) {
    names.push_back(path_of(id) + ".glb");
    if (id.level % kSubtreeLevels == 0) names.push_back(path_of(id) + ".subtree");
  });
  std::ranges::sort(names);
  names.insert(names.begin(), kTileset);
  return names;
}

struct Packed {
  proto::ZipEntry entry;
  std::string bytes;
};

Result<Packed> packed(const std::string& folder, const std::string& name) {
  auto bytes = read_regular_file(folder + "/" + name);
  if (!bytes) return std::unexpected(bytes.error());
  if (bytes->size() > kMostBytes)
    return fail(Errc::out_of_range, name + " has 4 GiB or more, which an archive has no room for");
  Packed p{{.name = name, .crc = crc32(*bytes), .size = std::uint32_t(bytes->size())}, {}};
  p.bytes =
      deflate<std::string>(*bytes, Wrapping::none, kLevel, bytes->size() - bytes->size() / 10);
  if (p.bytes.empty())
    p.bytes = std::move(*bytes);
  else
    p.entry.method = proto::ZipMethod::deflated;
  p.entry.packed = std::uint32_t(p.bytes.size());
  return p;
}

class Archive {
 public:
  Archive(const std::string& folder, PartFile& file) : folder_(folder), file_(file) {}

  Result<ArchiveReport> make(const std::vector<std::string>& names, int threads, const Progress&);

 private:
  const std::string folder_;
  PartFile& file_;
  std::vector<proto::ZipEntry> entries_;
  std::uint64_t end_ = 0;

  Result<void> append(const std::string& bytes) {
    if (auto done = file_.write_at(end_, bytes); !done) return done;
    end_ += bytes.size();
    return {};
  }
  Result<void> add(const std::vector<std::string>& names, std::size_t from, std::size_t to,
                   int threads);
  Result<void> finish();
};

Result<void> Archive::add(const std::vector<std::string>& names, std::size_t from, std::size_t to,
                          int threads) {
  std::vector<Result<Packed>> made(to - from, fail(Errc::internal, "not run"));
  parallel_for(to - from, threads,
               [&](std::size_t i) { made[i] = packed(folder_, names[from + i]); });
  std::string bytes;
  for (Result<Packed>& one : made) {
    if (!one) return std::unexpected(one.error());
    one->entry.offset = end_ + bytes.size();
    bytes += proto::encode_local_header(one->entry) + one->bytes;
    entries_.push_back(std::move(one->entry));
  }
  return append(bytes);
}

Result<void> Archive::finish() {
  const std::string index = proto::encode_3tz_index(entries_);
  if (index.size() > kMostBytes)
    return fail(Errc::out_of_range, "too many files for the index of one archive");
  const auto size = std::uint32_t(index.size());
  entries_.push_back({.name = proto::k3tzIndex,
                      .crc = crc32(index),
                      .packed = size,
                      .size = size,
                      .offset = end_});
  if (auto done = append(proto::encode_local_header(entries_.back()) + index); !done) return done;
  if (auto done = append(proto::encode_directory(entries_, end_)); !done) return done;
  return file_.finish();
}

Result<ArchiveReport> Archive::make(const std::vector<std::string>& names, int threads,
                                    const Progress& progress) {
  for (std::size_t from = 0; from < names.size(); from += kBatch) {
    if (progress.stopped()) return fail(Errc::cancelled, "stopped before the archive was written");
    if (auto done = add(names, from, std::min(from + kBatch, names.size()), threads); !done)
      return std::unexpected(done.error());
    if (from / kBatch % (names.size() / kBatch / 200 + 1) == 0)
      progress.at(double(from) / double(names.size()));
  }
  if (auto done = finish(); !done) return std::unexpected(done.error());
  return ArchiveReport{names.size(), end_};
}

}  // namespace

Result<ArchiveReport> write_archive(const TileSet& set, const std::string& folder,
                                    const std::string& file, int threads,
                                    const Progress& progress) {
  if (!read_regular_file(folder + "/" + kTileset))
    return fail(Errc::invalid_argument,
                folder + " holds no finished 3D Tiles: it has no tileset.json");
  const auto lock = FolderLock::take(folder);
  if (!lock) return std::unexpected(lock.error());
  auto part = PartFile::begin(file, kBegins);
  if (!part) return std::unexpected(part.error());
  return Archive(folder, *part).make(names_of(set), threads, progress);
}

}  // namespace tind::tiles3d
