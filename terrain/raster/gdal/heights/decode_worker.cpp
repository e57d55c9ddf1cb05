// A process that opens and reads files for another: the other end of apart_file.cpp. Nothing here
// is asked by strangers, but what is decoded may be theirs. So before the first byte of a raster is
// looked at, the process gives up whatever it does not need.
//
// A raster's error is an answer; only what GDAL does not survive ends the process.

#include <cpl_conv.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>

#include "terrain/base/errno_text.h"
#include "terrain/raster/gdal/crs/proj_places.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/heights/file_wire.h"
#include "terrain/raster/gdal/heights/gdal_file.h"
#include "terrain/raster/offset_grid.h"
#include "terrain/raster/sandbox/lockdown.h"
#include "terrain/raster/sandbox/nursery.h"
#include "terrain/raster/sandbox/wire.h"
#include "terrain/raster/sandboxed_pool.h"

namespace tind {
namespace gdal {
namespace {

using sandbox::Ask;
using sandbox::Reply;
using sandbox::Request;

// One process: a block of 64 MiB, a file that is decoded as a whole and unpacked before, libraries.
constexpr std::size_t kMemory = std::size_t(2) << 30, kUnpacked = 256u << 20, kOpenFiles = 32;
constexpr unsigned kCpuSeconds = 3600;  // more than the other end lets it have

Result<std::string> read_all(int from) {
  std::string bytes;
  std::array<char, 65536> some;
  for (;;) {
    const ssize_t n = ::read(from, some.data(), some.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return fail(Errc::io, std::string("the sandbox's brief: ") + errno_text(errno));
    if (n == 0) return bytes;
    bytes.append(some.data(), std::size_t(n));
  }
}

/// Files of the DEM, and what libraries look up; a VRT may name any file.
Result<sandbox::Allowed> allowed_for(const Brief& brief) {
  auto files = files_of_rasters(brief.files);
  if (!files) return std::unexpected(files.error());
  sandbox::Allowed allowed{std::move(*files), places_of_proj()};
  if (const char* const one = CPLFindFile("gdal", "gdalvrt.xsd"))
    allowed.folders.push_back(std::filesystem::path(one).parent_path().string());
  if (brief.options.allow_vrt) allowed.folders.push_back("/");
  return allowed;
}

class Worker {
 public:
  Result<void> begin();
  Reply answer(const Request&);
  Reply refused(const Error&);

 private:
  Result<Reply> open(const Request&);
  Result<Reply> read(const Request&);
  Result<Reply> read_posts(const Request&);
  Result<Reply> grid(const Request&);
  Result<RasterFile*> file(const Request&);
  Reply heights(const RasterFile&, const std::array<std::uint64_t, sandbox::kCounters>& before);

  std::byte* shared_ = nullptr;
  Brief brief_;
  std::shared_ptr<IdleHandles> idle_;
  std::vector<std::unique_ptr<RasterFile>> files_;
};

Result<void> Worker::begin() {
  void* const memory = ::mmap(nullptr, sandbox::kSharedBytes, PROT_READ | PROT_WRITE, MAP_SHARED,
                              sandbox::kShared, 0);
  if (memory == MAP_FAILED) return fail(Errc::io, "no memory to decode into");
  shared_ = static_cast<std::byte*>(memory);
  const auto bytes = read_all(sandbox::kBrief);
  if (!bytes) return std::unexpected(bytes.error());
  auto brief = read_brief(*bytes);
  if (!brief) return std::unexpected(brief.error());
  brief_ = std::move(*brief);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != pid_t(brief_.parent)) return fail(Errc::cancelled, "nobody waits any more");
  set_up();
  if (brief_.options.allow_vrt) register_vrt();
  const auto allowed = allowed_for(brief_);
  if (!allowed) return std::unexpected(allowed.error());
  const auto locked =
      sandbox::lock_down(*allowed, {.memory_bytes = kMemory, .cpu_seconds = kCpuSeconds});
  if (!locked) return std::unexpected(locked.error());
  idle_ = std::make_shared<IdleHandles>(kUnpacked, kOpenFiles);
  files_.resize(brief_.files.size());
  return {};
}

Reply Worker::refused(const Error& error) {
  Reply reply;
  reply.status = 1 + std::uint32_t(error.code);
  if (!shared_) return reply;
  reply.text_bytes = std::uint32_t(std::min(error.what.size(), sandbox::kMostMessage));
  std::memcpy(shared_, error.what.data(), reply.text_bytes);
  return reply;
}

Result<RasterFile*> Worker::file(const Request& request) {
  if (request.file >= files_.size() || !files_[request.file])
    return fail(Errc::internal, "a file that is not open is to be read");
  return files_[request.file].get();
}

Result<Reply> Worker::open(const Request& request) {
  if (request.file >= files_.size()) return fail(Errc::internal, "there is no such file");
  auto file = RasterFile::open(brief_.files[request.file], brief_.options, idle_);
  if (!file) return std::unexpected(file.error());
  const std::string text = opened_text(**file);
  if (text.size() > sandbox::kMostText)
    return fail(Errc::bad_data,
                brief_.files[request.file] + ": describes itself in more than 256 KiB");
  files_[request.file] = std::move(*file);
  std::memcpy(shared_, text.data(), text.size());
  Reply reply;
  reply.text_bytes = std::uint32_t(text.size());
  return reply;
}

std::array<std::uint64_t, sandbox::kCounters> counted(const RasterFile& file) {
  std::array<std::uint64_t, sandbox::kCounters> all;
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = file.customary(k);
  return all;
}

Reply Worker::heights(const RasterFile& file,
                      const std::array<std::uint64_t, sandbox::kCounters>& before) {
  Reply reply;
  const auto now = counted(file);
  for (std::size_t k = 0; k < now.size(); ++k) reply.counted[k] = std::uint32_t(now[k] - before[k]);
  return reply;
}

Result<Reply> Worker::read(const Request& request) {
  const auto found = file(request);
  if (!found) return std::unexpected(found.error());
  const RasterFile& raster = **found;
  if (request.cols < 1 || request.rows < 1 ||
      std::size_t(request.cols) * std::size_t(request.rows) > sandbox::kWindowPosts)
    return fail(Errc::internal, "too many posts at once");
  const auto before = counted(raster);
  const std::span out(reinterpret_cast<double*>(shared_),
                      std::size_t(request.cols) * std::size_t(request.rows));
  auto done = raster.read(request.col, request.row, request.cols, request.rows, out);
  if (!done) return std::unexpected(done.error());
  return heights(raster, before);
}

Result<Reply> Worker::read_posts(const Request& request) {
  const auto found = file(request);
  if (!found) return std::unexpected(found.error());
  const RasterFile& raster = **found;
  if (request.count > sandbox::kWindowPosts) return fail(Errc::internal, "too many posts at once");
  const auto before = counted(raster);
  std::vector<HeightFile::Post> posts(request.count);
  const std::byte* from = shared_ + sandbox::kHeightBytes;
  auto* const out = reinterpret_cast<double*>(shared_);
  for (std::size_t i = 0; i < posts.size(); ++i) {
    std::int32_t place[2];
    std::memcpy(place, from + i * sizeof place, sizeof place);
    posts[i] = {place[0], place[1], out + i};
  }
  if (auto done = raster.read_posts(posts); !done) return std::unexpected(done.error());
  return heights(raster, before);
}

Result<Reply> Worker::grid(const Request& request) {
  if (request.file >= files_.size()) return fail(Errc::internal, "there is no such file");
  Reply reply;
  reply.counted[0] = is_offset_grid(brief_.files[request.file]) ? 1 : 0;
  return reply;
}

Reply Worker::answer(const Request& request) {
  Result<Reply> reply = fail(Errc::internal, "nobody knows what is asked for");
  try {
    if (request.ask == Ask::open) reply = open(request);
    if (request.ask == Ask::read) reply = read(request);
    if (request.ask == Ask::posts) reply = read_posts(request);
    if (request.ask == Ask::grid) reply = grid(request);
  } catch (const std::bad_alloc&) {
    reply = fail(Errc::io, "decoding it takes more memory than there is for a raster");
  } catch (const std::exception& error) {
    reply = fail(Errc::internal, error.what());
  }
  return reply ? *reply : refused(reply.error());
}

bool send(const Reply& reply) {
  ssize_t n;
  while ((n = ::write(sandbox::kSocket, &reply, sizeof reply)) < 0 && errno == EINTR) {
  }
  return n == ssize_t(sizeof reply);
}

}  // namespace
}  // namespace gdal

int nurse_for_others() {
  gdal::set_up();  // what all copies need
  return sandbox::nurse(decode_for_others);
}

int decode_for_others() {
  gdal::Worker worker;
  const auto begun = worker.begin();
  if (!gdal::send(begun ? sandbox::Reply{} : worker.refused(begun.error())) || !begun) return 1;
  for (;;) {
    sandbox::Request request;
    const ssize_t n = ::read(sandbox::kSocket, &request, sizeof request);
    if (n < 0 && errno == EINTR) continue;
    if (n != ssize_t(sizeof request) || request.magic != sandbox::kMagic) break;
    auto reply = worker.answer(request);
    reply.number = request.number;
    if (!gdal::send(reply)) break;
  }
  ::_exit(0);  // nothing is to be put away
}

}  // namespace tind
