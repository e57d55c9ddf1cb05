#pragma once
// How processes that decode are begun: with three descriptors and little else of ours.

#include <fcntl.h>
#include <sys/types.h>
#include <unistd.h>

#include <array>
#include <span>
#include <string>
#include <utility>

#include "terrain/base/result.h"
#include "terrain/raster/sandbox/wire.h"

namespace tind::sandbox {

/// A descriptor that is closed in the end.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }
  /// The same, where no descriptor of the process's own will be.
  bool move_up() {
    const int up = ::fcntl(fd_, F_DUPFD_CLOEXEC, kBrief + 1);
    if (up < 0) return false;
    ::close(std::exchange(fd_, up));
    return true;
  }

 private:
  int fd_;
};

/// Ours that are to be a process's kSocket, kShared and kBrief; -1: it has none. REQUIRES: moved
/// up.
using Descriptors = std::array<int, 3>;

/// Begins a program with its arguments, with those descriptors alone, and those variables of our
/// environment that its libraries look for their files by. Fails (io) saying why.
Result<pid_t> spawn(std::span<const std::string> command, const Descriptors&);

}  // namespace tind::sandbox
