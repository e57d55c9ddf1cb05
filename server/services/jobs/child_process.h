#pragma once
// A program that runs beside the daemon: within limits of its own, its lines heard, and gone when
// nobody wants it any more, or when the daemon itself goes.

#include <chrono>
#include <cstddef>
#include <functional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>

#include "terrain/base/result.h"

namespace tind::services {

/// What one process may take; 0: as much as it likes.
struct ChildLimits {
  std::size_t memory_bytes = 0;  // of address space
  std::size_t file_bytes = 0;    // of each file that it writes
  std::chrono::seconds cpu_time{0}, wall_time{0};
  int niceness = 19;  // the others first
};

struct ChildEnd {
  enum class Why { exited, killed, stopped, out_of_time };
  Why why = Why::exited;
  int code = 0;  // of exited: its exit code; of killed: the signal
};

/// Runs a program and waits for its end. `arguments`: its path, then what it is told; `folder`: the
/// working directory. Standard error is heard line by line (of long lines the beginning), standard
/// output is nobody's, no descriptor is inherited. It runs in a process group of its own, which
/// ends with the calling thread. Once `stop` asks, it has a third of a second. Fails (io) where it
/// cannot be begun.
Result<ChildEnd> run_child(std::span<const std::string> arguments, const std::string& folder,
                           const ChildLimits&,
                           const std::function<void(std::string_view line)>& heard,
                           const std::stop_token& stop);

}  // namespace tind::services
