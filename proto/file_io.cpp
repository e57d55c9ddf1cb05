// POSIX calls instead of streams: a stream cannot say *why* a write failed, and close() is where
// some file systems report a full disk.

#include "proto/file_io.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

namespace tind::proto {
namespace {

std::unexpected<std::string> failed(const std::string& what, const std::string& path, int code) {
  return std::unexpected("cannot " + what + " " + path + ": " + std::strerror(code));
}

/// 0, or errno.
int write_and_close(int file, std::string_view bytes) {
  int code = 0;
  while (!bytes.empty() && code == 0) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written >= 0)
      bytes.remove_prefix(std::size_t(written));
    else if (errno != EINTR)
      code = errno;
  }
  if (::close(file) != 0 && code == 0) code = errno;
  return code;
}

}  // namespace

std::expected<std::string, std::string> read_whole_file(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return failed("open", path, errno);
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

std::expected<void, std::string> write_whole_file(const std::string& path, std::string_view bytes) {
  std::error_code ignored;
  std::string target = path;
  if (const auto real = std::filesystem::canonical(path, ignored); !ignored) target = real.string();
  struct stat status {};
  if (::stat(target.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
    const int device = ::open(target.c_str(), O_WRONLY | O_CLOEXEC);
    if (device < 0) return failed("open", path, errno);
    if (const int code = write_and_close(device, bytes)) return failed("write", path, code);
    return {};
  }
  const std::string partial = target + ".partial-" + std::to_string(::getpid());
  const int file = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) return failed("create", path, errno);
  int code = write_and_close(file, bytes);
  if (code == 0 && ::rename(partial.c_str(), target.c_str()) != 0) code = errno;
  if (code == 0) return {};
  ::unlink(partial.c_str());
  return failed("write", path, code);
}

}  // namespace tind::proto
