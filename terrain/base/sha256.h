#pragma once
// SHA-256 (FIPS 180-4), for what must not be found from its hash.

#include <array>
#include <cstdint>
#include <string>

#include "terrain/base/bytes.h"

namespace tind {

using Sha256 = std::array<std::uint8_t, 32>;

Sha256 sha256(ByteView bytes);

/// The same of bytes that come in parts.
class Sha256Sum {
 public:
  void add(ByteView bytes);
  /// Once.
  Sha256 finish();

 private:
  std::array<std::uint32_t, 8> state_ = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                         0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::uint8_t, 64> rest_{};  // of a block that is not full
  std::uint64_t size_ = 0;
};

/// 64 digits.
std::string hex_of(const Sha256&);

}  // namespace tind
