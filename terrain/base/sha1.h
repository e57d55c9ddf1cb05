#pragma once
// SHA-1 (FIPS 180-4), where somebody else's format asks for it. Not for secrets, and not for our
// own: hash.h is faster.

#include <string>

#include "terrain/base/bytes.h"

namespace tind {

/// 40 digits.
std::string sha1(ByteView bytes);

}  // namespace tind
