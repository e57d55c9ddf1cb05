#include "terrain/base/hash.h"

#include <xxhash.h>

#include <cinttypes>
#include <cstdio>

namespace tind {

std::uint64_t hash64(ByteView bytes, std::uint64_t seed) {
  return XXH3_64bits_withSeed(bytes.data, bytes.size, seed);
}

std::string Hash128::text() const {
  char digits[33];
  std::snprintf(digits, sizeof digits, "%016" PRIx64 "%016" PRIx64, high, low);
  return digits;
}

Hash128 hash128(ByteView bytes) {
  const XXH128_hash_t h = XXH3_128bits(bytes.data, bytes.size);
  return {h.low64, h.high64};
}

}  // namespace tind
