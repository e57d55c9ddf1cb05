#pragma once
// Hashes of bytes, for files and ETags: XXH3, the same on every machine. Not for secrets. The only
// user of xxHash.

#include <cstdint>
#include <string>

#include "terrain/base/bytes.h"

namespace tind {

std::uint64_t hash64(ByteView bytes, std::uint64_t seed = 0);

struct Hash128 {
  std::uint64_t low = 0, high = 0;

  /// 32 digits, the high half first.
  std::string text() const;

  bool operator==(const Hash128&) const = default;
};
Hash128 hash128(ByteView bytes);

}  // namespace tind
