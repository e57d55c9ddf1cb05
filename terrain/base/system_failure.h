#pragma once
// Which errors say that the system failed just now, and nothing of what was asked for. A folder
// that one may not look into is none of them: searches go on with the next.

#include <algorithm>
#include <array>
#include <cerrno>

namespace tind {

inline constexpr std::array kSystemFailures = {EIO, EMFILE, ENFILE, ENOMEM, ESTALE};

inline bool is_system_failure(int code) {
  return std::ranges::find(kSystemFailures, code) != kSystemFailures.end();
}

}  // namespace tind
