#pragma once
// A process that has loaded the program and its libraries, reads nothing, and becomes decoders: to
// begin the program takes longer than to copy one, nearly all of it for two hundred libraries.

#include <sys/types.h>

#include <functional>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/sandbox/spawn.h"

namespace tind::sandbox {

/// For one thread, with which it ends, and all that it has begun.
class Nursery {
 public:
  /// `command`: a program that calls nurse(). It begins when it is needed.
  explicit Nursery(std::vector<std::string> command) : command_(std::move(command)) {}
  ~Nursery() { end(); }
  Nursery(const Nursery&) = delete;
  Nursery& operator=(const Nursery&) = delete;

  /// A process with those descriptors, a child of ours like any other. Where the nursery was
  /// killed, a new one begins it. Fails (io) saying why.
  Result<pid_t> begin(const Descriptors&);

 private:
  Result<void> launch();
  Result<pid_t> hear(int patience_ms) const;
  Result<pid_t> ask(const Descriptors&) const;
  void end();

  const std::vector<std::string> command_;
  pid_t process_ = -1;
  int socket_ = -1;
};

/// What that program does: `decode` in each copy of itself, which then ends with what it returns;
/// it has the descriptors of wire.h and begins as one that was spawned. Returns when nobody needs
/// it any more. REQUIRES: no other thread runs.
int nurse(const std::function<int()>& decode);

}  // namespace tind::sandbox
