// Every SHORT_EVERY-th read and write of a file or of a TCP connection does half of what was asked
// for, as the system may at any time. SHORT_LOG: a file that gets how many were shortened.
#include <dlfcn.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
namespace {
std::atomic<unsigned long> calls{0}, shortened{0};
unsigned long every = 0;
struct Setup {
  Setup() {
    if (const char* n = std::getenv("SHORT_EVERY")) every = std::strtoul(n, nullptr, 10);
  }
  ~Setup() {
    if (const char* file = std::getenv("SHORT_LOG"))
      if (std::FILE* out = std::fopen(file, "w"))
        std::fprintf(out, "%lu", shortened.load()), std::fclose(out);
  }
} setup;

/// Messages have borders: a part of one would be another message.
bool may_be_short(int fd) {
  struct stat is {};
  if (fstat(fd, &is) != 0) return false;
  if (S_ISREG(is.st_mode)) return true;
  int domain = 0, type = 0;
  socklen_t size = sizeof domain;
  return S_ISSOCK(is.st_mode) && getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &domain, &size) == 0 &&
         getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_STREAM &&
         (domain == AF_INET || domain == AF_INET6);
}

std::size_t less(int fd, std::size_t asked) {
  if (every == 0 || asked < 2 || !may_be_short(fd) || ++calls % every != 0) return asked;
  ++shortened;
  return asked / 2;
}

template <class F>
F next(const char* name) {
  return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

/// The first piece, or half of it where that is all.
template <class F>
ssize_t pieces(F real, int fd, const iovec* all, int count) {
  if (every == 0 || count < 1 || !may_be_short(fd) || ++calls % every != 0)
    return real(fd, all, count);
  ++shortened;
  iovec first = all[0];
  if (count == 1 && first.iov_len > 1) first.iov_len /= 2;
  return first.iov_len > 0 ? real(fd, &first, 1) : real(fd, all, count);
}
}  // namespace

extern "C" {
ssize_t read(int fd, void* to, std::size_t n) {
  static const auto real = next<ssize_t (*)(int, void*, std::size_t)>("read");
  return real(fd, to, less(fd, n));
}
ssize_t write(int fd, const void* from, std::size_t n) {
  static const auto real = next<ssize_t (*)(int, const void*, std::size_t)>("write");
  return real(fd, from, less(fd, n));
}
ssize_t pread(int fd, void* to, std::size_t n, off_t at) {
  static const auto real = next<ssize_t (*)(int, void*, std::size_t, off_t)>("pread");
  return real(fd, to, less(fd, n), at);
}
ssize_t pread64(int fd, void* to, std::size_t n, off64_t at) {
  static const auto real = next<ssize_t (*)(int, void*, std::size_t, off64_t)>("pread64");
  return real(fd, to, less(fd, n), at);
}
ssize_t pwrite(int fd, const void* from, std::size_t n, off_t at) {
  static const auto real = next<ssize_t (*)(int, const void*, std::size_t, off_t)>("pwrite");
  return real(fd, from, less(fd, n), at);
}
ssize_t pwrite64(int fd, const void* from, std::size_t n, off64_t at) {
  static const auto real = next<ssize_t (*)(int, const void*, std::size_t, off64_t)>("pwrite64");
  return real(fd, from, less(fd, n), at);
}
ssize_t recv(int fd, void* to, std::size_t n, int flags) {
  static const auto real = next<ssize_t (*)(int, void*, std::size_t, int)>("recv");
  return real(fd, to, less(fd, n), flags);
}
ssize_t send(int fd, const void* from, std::size_t n, int flags) {
  static const auto real = next<ssize_t (*)(int, const void*, std::size_t, int)>("send");
  return real(fd, from, less(fd, n), flags);
}
ssize_t readv(int fd, const iovec* all, int count) {
  static const auto real = next<ssize_t (*)(int, const iovec*, int)>("readv");
  return pieces(real, fd, all, count);
}
ssize_t writev(int fd, const iovec* all, int count) {
  static const auto real = next<ssize_t (*)(int, const iovec*, int)>("writev");
  return pieces(real, fd, all, count);
}
ssize_t recvmsg(int fd, msghdr* message, int flags) {
  static const auto real = next<ssize_t (*)(int, msghdr*, int)>("recvmsg");
  return pieces(
      [&](int, const iovec* some, int count) {
        msghdr part = *message;
        part.msg_iov = const_cast<iovec*>(some), part.msg_iovlen = std::size_t(count);
        const ssize_t got = real(fd, &part, flags);
        part.msg_iov = message->msg_iov, part.msg_iovlen = message->msg_iovlen;
        *message = part;
        return got;
      },
      fd, message->msg_iov, int(message->msg_iovlen));
}
ssize_t sendmsg(int fd, const msghdr* message, int flags) {
  static const auto real = next<ssize_t (*)(int, const msghdr*, int)>("sendmsg");
  return pieces(
      [&](int, const iovec* some, int count) {
        msghdr part = *message;
        part.msg_iov = const_cast<iovec*>(some), part.msg_iovlen = std::size_t(count);
        return real(fd, &part, flags);
      },
      fd, message->msg_iov, int(message->msg_iovlen));
}
}
