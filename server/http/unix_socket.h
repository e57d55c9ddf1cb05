#pragma once
// A place to listen that only processes of this machine reach: a file that is a socket.

#include <string>
#include <utility>

#include "terrain/base/result.h"

namespace tind::http {

/// The file is there as long as this; then it is removed, if it is still the same.
class UnixSocket {
 public:
  /// Binds and listens, without waiting in accept(). For its owner alone: mode 0600. A socket file
  /// that nobody listens at any more, of a process that was killed, is replaced; another file, or
  /// a socket that somebody listens at, is an error that says so.
  static Result<UnixSocket> listen(const std::string& path, int backlog);
  UnixSocket(UnixSocket&& other) noexcept
      : path_(std::move(other.path_)), inode_(other.inode_), fd_(std::exchange(other.fd_, -1)) {
    other.path_.clear();
  }
  UnixSocket& operator=(UnixSocket&&) = delete;
  ~UnixSocket();

  /// Whoever takes it closes it.
  int take_descriptor() { return std::exchange(fd_, -1); }

 private:
  UnixSocket(std::string path, unsigned long inode, int fd)
      : path_(std::move(path)), inode_(inode), fd_(fd) {}
  std::string path_;
  unsigned long inode_;
  int fd_;
};

}  // namespace tind::http
