#include "terrain/base/random_bytes.h"

#include <sys/random.h>

#include <cerrno>

#include "terrain/base/errno_text.h"

namespace tind {

Result<void> random_bytes(std::span<std::uint8_t> bytes) {
  const ssize_t got = ::getrandom(bytes.data(), bytes.size(), 0);
  if (got == ssize_t(bytes.size())) return {};
  return fail(Errc::io, "the system gives no random bytes: " +
                            (got < 0 ? errno_text(errno) : std::string("too few")));
}

}  // namespace tind
