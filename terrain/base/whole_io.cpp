#include "terrain/base/whole_io.h"

#include <unistd.h>

#include <cerrno>
#include <vector>

namespace tind {
namespace {

/// `write`: of the rest, as write(2).
template <class Write>
int write_all(std::string_view bytes, Write&& write) {
  while (!bytes.empty()) {
    const ssize_t wrote = write(bytes);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return errno;
    if (wrote == 0) return EIO;  // a device that takes nothing would keep us for ever
    bytes.remove_prefix(std::size_t(wrote));
  }
  return 0;
}

}  // namespace

int write_whole(int file, std::string_view bytes) {
  return write_all(
      bytes, [file](std::string_view rest) { return ::write(file, rest.data(), rest.size()); });
}

int write_whole_at(int file, std::uint64_t at, std::string_view bytes) {
  const std::uint64_t end = at + bytes.size();
  return write_all(bytes, [file, end](std::string_view rest) {
    return ::pwrite(file, rest.data(), rest.size(), off_t(end - rest.size()));
  });
}

ReadBytes read_up_to(int file, std::uint64_t at, void* to, std::size_t size) {
  ReadBytes got;
  while (got.size < size) {
    const ssize_t n =
        ::pread(file, static_cast<char*>(to) + got.size, size - got.size, off_t(at + got.size));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) got.error = errno;
    if (n <= 0) break;
    got.size += std::size_t(n);
  }
  return got;
}

int read_to_end(int file) {
  std::vector<char> part(std::size_t(1) << 20);
  while (true) {
    const ssize_t n = ::read(file, part.data(), part.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return n < 0 ? errno : 0;
  }
}

bool read_whole_at(int file, std::uint64_t at, void* to, std::size_t size) {
  return read_up_to(file, at, to, size).size == size;
}

}  // namespace tind
