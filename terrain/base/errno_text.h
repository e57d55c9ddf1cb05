#pragma once
// What the system says of an error number.

#include <string>

namespace tind {

/// E.g. "No such file or directory" of ENOENT. For every thread, which std::strerror need not be.
std::string errno_text(int code);

}  // namespace tind
