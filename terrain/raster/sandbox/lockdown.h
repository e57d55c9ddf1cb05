#pragma once
// What a process may no longer do once it is locked down, whatever runs in it then.

#include <cstddef>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind::sandbox {

/// What the kernel, and whoever started us, lets us use. Asking changes nothing.
struct Support {
  bool seccomp = false;  // no system call but those that reading needs
  int landlock = 0;      // its version; 0: files outside of the allowed ones can be read
};
Support supported();
/// What is missing and what that means, for one line of a log; empty where nothing is.
std::string missing_text(const Support&);

/// What may still be opened, for reading.
struct Allowed {
  std::vector<std::string> files, folders;  // those that do not exist are left out
};

struct Lockdown {
  std::size_t memory_bytes = 0;  // of address space; 0: no limit
  unsigned cpu_seconds = 0;      // 0: no limit
  unsigned open_files = 256;
};

/// For good, and for all that this process may become: no file is opened but the allowed ones, none
/// is written, no socket is made, no program or thread begun, no memory made executable, no other
/// process touched; within limits of memory, processor time and descriptors. What the kernel lacks
/// is left out, and missing from what is returned. Fails (io) where something that it has does not
/// take hold. REQUIRES: no other thread runs.
Result<Support> lock_down(const Allowed&, const Lockdown&);

}  // namespace tind::sandbox
