#pragma once
// Limits that a process gives itself before it does what may need them.

#include <sys/resource.h>

#include <algorithm>

namespace tind {

/// Never more than there is, which nobody may. Where the soft limit is to come before the hard one,
/// so it does after that, too. False where a filter that somebody has put around the process
/// forbids limits: what they would have held is not held. Between fork and exec, too.
inline bool set_limit(int what, rlim_t soft, rlim_t hard) {
  rlimit now{};
  const auto which = __rlimit_resource(what);
  if (::getrlimit(which, &now) != 0) return false;
  rlimit both{std::min(soft, now.rlim_max), std::min(hard, now.rlim_max)};
  if (soft < hard && both.rlim_max > 1) both.rlim_cur = std::min(both.rlim_cur, both.rlim_max - 1);
  return ::setrlimit(which, &both) == 0;
}

inline bool set_limit(int what, rlim_t most) { return set_limit(what, most, most); }

}  // namespace tind
