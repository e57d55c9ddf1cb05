#pragma once
// SHA-256 (FIPS 180-4), for what must not be found from its hash.

#include <array>
#include <cstdint>
#include <string>

#include "terrain/base/bytes.h"

namespace tind {

using Sha256 = std::array<std::uint8_t, 32>;

Sha256 sha256(ByteView bytes);

/// 64 digits.
std::string hex_of(const Sha256&);

}  // namespace tind
