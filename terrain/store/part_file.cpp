#include "terrain/store/part_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <utility>

#include "terrain/base/errno_text.h"
#include "terrain/base/same_file.h"
#include "terrain/base/whole_io.h"

namespace tind {

namespace {

namespace fs = std::filesystem;

std::unexpected<Error> failed(const std::string& what, const std::string& path, int code) {
  return fail(Errc::io, "cannot " + what + " " + path + ": " + errno_text(code));
}

Result<bool> is_left_behind(int file, const std::string& part, std::string_view begins) {
  struct stat status {};
  if (::fstat(file, &status) != 0) return failed("look into", part, errno);
  if (!S_ISREG(status.st_mode)) return false;
  if (status.st_size == 0) return true;
  std::array<char, 16> found{};
  const ReadBytes got = read_up_to(file, 0, found.data(), std::min(found.size(), begins.size()));
  if (got.error != 0) return failed("read", part, got.error);
  return std::string_view(found.data(), got.size) == begins.substr(0, 16);
}

}  // namespace

Result<PartFile> PartFile::begin(const std::string& path, std::string_view begins) {
  std::error_code error;
  const auto real = fs::canonical(path, error);
  if (error && error != std::errc::no_such_file_or_directory)  // a link would be replaced
    return failed("look into", path, error.value());
  std::string target = error ? path : real.string(), part = target + ".tind-part";
  for (;;) {
    const int file =
        ::open(part.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666);
    if (file < 0 && (errno == ELOOP || errno == EISDIR))
      return fail(Errc::invalid_argument, part + " is in the way: it is no file");
    if (file < 0) return failed("create", part, errno);
    PartFile opened(file, target, part);
    if (::flock(file, LOCK_EX | LOCK_NB) != 0) {
      opened.part_.clear();
      if (errno != EWOULDBLOCK) return failed("lock", part, errno);
      return fail(Errc::busy, part + ": another program is writing it");
    }
    const auto still = is_still_at(file, part);  // whoever had it may have given it its name
    if (!still || !*still) opened.part_.clear();
    if (!still) return std::unexpected(still.error());
    if (!*still) continue;
    const auto ours = is_left_behind(file, part, begins);
    if (!ours || !*ours) opened.part_.clear();
    if (!ours) return std::unexpected(ours.error());
    if (!*ours)
      return fail(Errc::invalid_argument,
                  part + " is there, and tind did not make it: move it away");
    if (::ftruncate(file, 0) != 0) return failed("write", part, errno);
    return opened;
  }
}

PartFile::PartFile(PartFile&& other) noexcept
    : file_(std::exchange(other.file_, -1)),
      target_(std::move(other.target_)),
      part_(std::move(other.part_)) {}

PartFile::~PartFile() {
  if (file_ < 0) return;
  if (!part_.empty()) ::unlink(part_.c_str());
  ::close(file_);
}

Result<void> PartFile::write_at(std::uint64_t at, std::string_view bytes) {
  return write_all_at(file_, at, bytes, part_);
}

Result<void> PartFile::finish() {
  if (::fsync(file_) != 0) return failed("write", part_, errno);
  if (::rename(part_.c_str(), target_.c_str()) != 0)
    return failed("put into place", target_, errno);
  part_.clear();
  const fs::path folder = fs::path(target_).parent_path();
  const int opened =
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (opened < 0) return failed("sync", folder.string(), errno);
  // Some network file systems do not sync folders: their servers keep names by themselves.
  const int code = ::fsync(opened) == 0 || errno == EINVAL ? 0 : errno;
  ::close(opened);
  if (code != 0) return failed("sync", folder.string(), code);
  return {};
}

Result<void> write_all_at(int file, std::uint64_t at, std::string_view bytes,
                          const std::string& name) {
  if (const int code = write_whole_at(file, at, bytes)) return failed("write", name, code);
  return {};
}

}  // namespace tind
