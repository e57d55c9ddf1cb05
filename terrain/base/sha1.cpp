#include "terrain/base/sha1.h"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace tind {
namespace {

using State = std::array<std::uint32_t, 5>;
constexpr std::size_t kBlock = 64;

void add_block(State& state, const std::uint8_t* block) {
  std::uint32_t w[80];
  for (int i = 0; i < 16; ++i) w[i] = load<std::uint32_t, std::endian::big>(block + 4 * i);
  for (int i = 16; i < 80; ++i) w[i] = std::rotl(w[i - 3] ^ w[i - 8] ^ w[i - 14] ^ w[i - 16], 1);
  auto [a, b, c, d, e] = state;
  for (int i = 0; i < 80; ++i) {
    std::uint32_t f, k;
    if (i < 20)
      f = (b & c) | (~b & d), k = 0x5a827999;
    else if (i < 40)
      f = b ^ c ^ d, k = 0x6ed9eba1;
    else if (i < 60)
      f = (b & c) | (b & d) | (c & d), k = 0x8f1bbcdc;
    else
      f = b ^ c ^ d, k = 0xca62c1d6;
    const std::uint32_t next = std::rotl(a, 5) + f + e + k + w[i];
    e = d, d = c, c = std::rotl(b, 30), b = a, a = next;
  }
  state[0] += a, state[1] += b, state[2] += c, state[3] += d, state[4] += e;
}

}  // namespace

std::string sha1(ByteView bytes) {
  State state = {0x67452301, 0xefcdab89, 0x98badcfe, 0x10325476, 0xc3d2e1f0};
  const auto* data = static_cast<const std::uint8_t*>(bytes.data);
  std::size_t at = 0;
  for (; bytes.size - at >= kBlock; at += kBlock) add_block(state, data + at);
  // The rest, a one, zeros, and the length in bits.
  std::uint8_t last[2 * kBlock] = {};
  const std::size_t rest = bytes.size - at, blocks = rest + 9 <= kBlock ? 1 : 2;
  if (rest > 0) std::memcpy(last, data + at, rest);
  last[rest] = 0x80;
  store<std::endian::big>(std::uint64_t(bytes.size) * 8, last + blocks * kBlock - 8);
  for (std::size_t i = 0; i < blocks; ++i) add_block(state, last + i * kBlock);
  std::string text;
  for (const std::uint32_t word : state)
    for (int shift = 28; shift >= 0; shift -= 4) text += "0123456789abcdef"[word >> shift & 15];
  return text;
}

}  // namespace tind
