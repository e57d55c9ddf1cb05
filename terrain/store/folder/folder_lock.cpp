#include "terrain/store/folder/folder_lock.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <ctime>
#include <utility>

#include "terrain/base/descriptor.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/same_file.h"
#include "terrain/base/whole_io.h"
#include "terrain/store/folder/folder_files.h"

namespace tind {

namespace {

constexpr std::string_view kWho = "tind build: ";
// Beyond what is written: where locks are mandatory, the others can still read who holds it.
constexpr off_t kLockedByte = 1 << 20;

std::string who() {
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host = {"?"};
  std::array<char, 32> since{};
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  std::strftime(since.data(), since.size(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return std::string(kWho) + "process " + std::to_string(::getpid()) + " on " + host.data() +
         " since " + since.data() + "\n";
}

std::unexpected<Error> lock_failed(const std::string& what, const std::string& path, int code) {
  return fail(Errc::io, "cannot " + what + " " + path + ": " + errno_text(code));
}

/// Fails where it cannot be read: what is written over might be somebody else's.
Result<std::string> read_line(int file, const std::string& path) {
  std::array<char, 512> text{};
  const ReadBytes got = read_up_to(file, 0, text.data(), text.size());
  if (got.error != 0) return lock_failed("read", path, got.error);
  const std::string_view all(text.data(), got.size);
  return std::string(all.substr(0, all.find('\n')));
}

Result<bool> is_regular(int file, const std::string& path) {
  struct stat status {};
  if (::fstat(file, &status) != 0) return lock_failed("look into", path, errno);
  return S_ISREG(status.st_mode);
}

std::unexpected<Error> in_the_way(const std::string& path) {
  return fail(Errc::invalid_argument,
              path + " is in the way and not tind's: choose another directory");
}

struct flock locked_byte() {
  struct flock byte {};
  byte.l_type = F_WRLCK, byte.l_whence = SEEK_SET, byte.l_start = kLockedByte, byte.l_len = 1;
  return byte;
}

/// `says`: the line in the lock's file, which comes a moment after the lock.
std::string is_built(const std::string& folder, const std::string& says) {
  return folder + " is being built by another tind (" +
         (says.empty() ? "just begun" : says.substr(kWho.size())) + "): wait for it";
}

}  // namespace

Result<FolderLock> FolderLock::take(const std::string& folder) {
  const std::string path = folder + "/" + kName;
  for (;;) {
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (file < 0 && (errno == ELOOP || errno == EISDIR)) return in_the_way(path);
    if (file < 0) return lock_failed("create", path, errno);
    FolderLock lock(path, file);
    const auto regular = is_regular(file, path);
    if (!regular || !*regular) lock.path_.clear();  // not ours to remove
    if (!regular) return std::unexpected(regular.error());
    if (!*regular) return in_the_way(path);
    struct flock byte = locked_byte();
    const bool taken = ::fcntl(file, F_OFD_SETLK, &byte) == 0;
    const int code = errno;
    const auto line = read_line(file, path);
    const std::string says = line.value_or("");
    if (!line || (!says.empty() && !says.starts_with(kWho))) {
      lock.path_.clear();  // not ours to remove
      return line ? in_the_way(path) : std::unexpected(line.error());
    }
    if (!taken) {
      lock.path_.clear();
      if (code != EAGAIN && code != EACCES) return lock_failed("lock", path, code);
      return fail(Errc::busy, is_built(folder, says) + ", or choose another directory");
    }
    // Whoever had it may have removed the file after it was opened here.
    const auto still = is_still_at(file, path);
    if (!still || !*still) lock.path_.clear();
    if (!still) return std::unexpected(still.error());
    if (!*still) continue;
    lock.left_behind_ = !says.empty();
    const std::string text = who();
    // Never empty in between: a file without text would not say that a build began here.
    int failed = write_whole_at(file, 0, text);
    if (failed == 0 && (::ftruncate(file, off_t(text.size())) != 0 || ::fsync(file) != 0))
      failed = errno;
    const auto kept = failed == 0 ? FolderFiles().sync_folder(folder) : Result<void>();
    if (failed == 0 && kept) return lock;
    if (lock.left_behind_) lock.path_.clear();  // it says that a build began here, and goes on to
    if (!kept) return std::unexpected(kept.error());
    return lock_failed("write", path, failed);
  }
}

Result<void> FolderLock::nobody_has(const std::string& folder) {
  const std::string path = folder + "/" + kName;
  // It may be a pipe of somebody's, for which nobody waits.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (file.get() < 0 || !is_regular(file.get(), path).value_or(false)) return {};
  struct flock byte = locked_byte();
  if (::fcntl(file.get(), F_OFD_GETLK, &byte) != 0 || byte.l_type == F_UNLCK) return {};
  const auto says = read_line(file.get(), path);
  if (!says || (!says->empty() && !says->starts_with(kWho))) return {};
  return fail(Errc::busy, is_built(folder, *says));
}

FolderLock::FolderLock(FolderLock&& other) noexcept
    : path_(std::move(other.path_)),
      file_(std::exchange(other.file_, -1)),
      left_behind_(other.left_behind_) {}

FolderLock::~FolderLock() {
  if (file_ < 0) return;
  if (!path_.empty()) ::unlink(path_.c_str());
  ::close(file_);
}

}  // namespace tind
