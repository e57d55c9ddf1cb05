#pragma once
// MD5 (RFC 1321), where somebody else's format asks for it. Not for secrets, and not for our own:
// hash.h is faster.

#include <array>
#include <cstdint>

#include "terrain/base/bytes.h"

namespace tind {

std::array<std::uint8_t, 16> md5(ByteView bytes);

}  // namespace tind
