#include "terrain/base/keyed_hash.h"

#include <unistd.h>

#include <array>
#include <bit>
#include <chrono>

#include "terrain/base/random_bytes.h"

namespace tind {
namespace {

/// One to add, one to multiply with.
std::array<std::uint64_t, 2> draw() {
  std::array<std::uint8_t, 16> bytes{};
  if (random_bytes(bytes)) return std::bit_cast<std::array<std::uint64_t, 2>>(bytes);
  // Less than a secret, and more than everybody knows.
  const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
  return {std::uint64_t(now), std::uint64_t(now) << 20 ^ std::uint64_t(::getpid())};
}

}  // namespace

std::uint64_t keyed_hash(std::uint64_t number) {
  static const std::array<std::uint64_t, 2> key = draw();
  const auto product = (unsigned __int128)(number ^ key[0]) * (key[1] | 1);
  const std::uint64_t h = std::uint64_t(product) ^ std::uint64_t(product >> 64);
  return (h ^ (h >> 29)) * 0xbf58476d1ce4e5b9ull;
}

}  // namespace tind
