// POSIX calls instead of streams: a stream cannot say *why* a write failed, and close() is where
// some file systems report a full disk.

#include "terrain/base/file_io.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <random>

#include "terrain/base/whole_io.h"

namespace tind {
namespace {

std::unexpected<Error> failed(const std::string& what, const std::string& path, int code,
                              Errc errc = Errc::io) {
  return fail(errc, "cannot " + what + " " + path + ": " + std::strerror(code));
}

/// A link is followed, so that it stays one, also one to a file that is not there yet.
std::string target_of(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (const fs::path real = fs::canonical(path, error); !error) return real.string();
  fs::path target = path;
  for (int links = 0; links < 40 && fs::is_symlink(target, error); ++links)
    target = target.parent_path() / fs::read_symlink(target, error);
  return target.string();
}

/// What is open under a path, or -1: with `-o /dev/stdout > FILE` the file is the shell's, which
/// may be in the midst of it.
int open_descriptor(std::string_view path) {
  if (path == "/dev/stdout") return STDOUT_FILENO;
  if (path == "/dev/stderr") return STDERR_FILENO;
  for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
    if (!path.starts_with(folder)) continue;
    int file = -1;
    const auto end = path.data() + path.size();
    const auto read = std::from_chars(path.data() + folder.size(), end, file);
    if (read.ec == std::errc() && read.ptr == end && ::fcntl(file, F_GETFD) >= 0) return file;
  }
  return -1;
}

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

bool is_special(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode);
}

/// Of processes on any host, no two get the same.
std::string partial_name(const std::string& target) {
  std::random_device random;
  char text[40];
  std::snprintf(text, sizeof text, ".partial-%08x%08x", random(), random());
  return target + text;
}

/// A file on its way to its name. Where the file system can, it has none until it is whole, so that
/// nothing is left of it when the process is killed.
struct Partial {
  int file = -1;
  std::string name;

  Partial(const std::string& target, bool nameless) {
    if (nameless) file = ::open(folder_of(target).c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
    if (file >= 0) return;
    name = partial_name(target);
    file = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  }
  ~Partial() {
    if (file >= 0) ::close(file);
    if (file >= 0 && !name.empty()) ::unlink(name.c_str());  // of no use once it has moved
  }
  Partial(const Partial&) = delete;
  Partial& operator=(const Partial&) = delete;

  bool nameless() const { return name.empty(); }
  /// 0, or errno.
  int get_a_name(const std::string& target) {
    const std::string wanted = partial_name(target);
    const std::string self = "/proc/self/fd/" + std::to_string(file);
    if (::linkat(AT_FDCWD, self.c_str(), AT_FDCWD, wanted.c_str(), AT_SYMLINK_FOLLOW) != 0)
      return errno;
    name = wanted;
    return 0;
  }
  /// 0, or errno. It stays open only to be synced with its folder.
  int move_to(const std::string& target) {
    if (::rename(name.c_str(), target.c_str()) != 0) return errno;
    name.clear();
    return 0;
  }
};

/// 0, or errno.
int sync_folder(const std::string& folder) {
  const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return errno;
  const int code = ::fsync(file) == 0 || errno == EINVAL ? 0 : errno;  // some network file systems
  ::close(file);
  return code;
}

}  // namespace

Result<std::string> read_whole_file(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return failed("open", path, errno, Errc::not_found);
  std::string bytes;
  struct stat status {};
  if (::fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_size > 0)
    bytes.reserve(std::size_t(status.st_size) + 1);
  char buffer[1 << 16];
  for (;;) {
    const ssize_t got = ::read(file, buffer, sizeof buffer);
    if (got > 0) bytes.append(buffer, std::size_t(got));
    if (got == 0) break;
    if (got < 0 && errno != EINTR) {
      const int code = errno;
      ::close(file);
      return failed("read", path, code);
    }
  }
  ::close(file);
  return bytes;
}

Result<std::string> read_regular_file(const std::string& path) {
  if (is_special(path)) return fail(Errc::io, "cannot read " + path + ": not a regular file");
  return read_whole_file(path);
}

Result<void> write_whole_file(const std::string& path, std::string_view bytes) {
  if (const int file = open_descriptor(path); file >= 0) {
    const int code = write_whole(file, bytes);
    if (code != 0) return failed("write", path, code);
    return {};
  }
  const std::string target = target_of(path);
  if (is_special(target)) {
    const int device = ::open(target.c_str(), O_WRONLY | O_CLOEXEC);
    if (device < 0) return failed("open", path, errno);
    int code = write_whole(device, bytes);
    if (::close(device) != 0 && code == 0) code = errno;
    if (code != 0) return failed("write", path, code);
    return {};
  }
  for (const bool nameless : {true, false}) {
    Partial partial(target, nameless);
    if (partial.file < 0) return failed("create", path, errno);
    int code = write_whole(partial.file, bytes);
    if (code == 0 && ::fsync(partial.file) != 0) code = errno;
    if (code == 0 && partial.nameless() && partial.get_a_name(target) != 0) continue;  // no /proc
    if (code == 0) code = partial.move_to(target);
    if (code == 0) code = sync_folder(folder_of(target));
    if (code != 0) return failed("write", path, code);
    return {};
  }
  return failed("write", path, EIO);
}

Result<void> can_write_file(const std::string& path) {
  if (open_descriptor(path) >= 0) return {};
  const std::string target = target_of(path);
  struct stat status {};
  if (::stat(target.c_str(), &status) == 0 && S_ISDIR(status.st_mode))
    return failed("write", path, EISDIR);
  if (is_special(target)) {
    if (::access(target.c_str(), W_OK) != 0) return failed("open", path, errno);
    return {};
  }
  const Partial partial(target, true);
  if (partial.file < 0) return failed("create", path, errno);
  return {};
}

}  // namespace tind
