#include "terrain/base/md5.h"

#include <bit>
#include <cmath>
#include <cstring>

namespace tind {
namespace {

using State = std::array<std::uint32_t, 4>;
constexpr std::size_t kBlock = 64;

/// 3.4: the integer part of 2^32 |sin(i)|.
const std::array<std::uint32_t, 64>& sines() {
  static const auto table = [] {
    std::array<std::uint32_t, 64> t;
    for (std::size_t i = 0; i < t.size(); ++i)
      t[i] = std::uint32_t(std::int64_t(std::ldexp(std::abs(std::sin(double(i + 1))), 32)));
    return t;
  }();
  return table;
}

void add_block(State& state, const std::uint8_t* block) {
  constexpr int kTurns[4][4] = {{7, 12, 17, 22}, {5, 9, 14, 20}, {4, 11, 16, 23}, {6, 10, 15, 21}};
  auto [a, b, c, d] = state;
  for (std::size_t i = 0; i < 64; ++i) {
    std::uint32_t f;
    std::size_t word;
    if (i < 16)
      f = (b & c) | (~b & d), word = i;
    else if (i < 32)
      f = (d & b) | (~d & c), word = (5 * i + 1) % 16;
    else if (i < 48)
      f = b ^ c ^ d, word = (3 * i + 5) % 16;
    else
      f = c ^ (b | ~d), word = 7 * i % 16;
    f += a + sines()[i] + load<std::uint32_t>(block + 4 * word);
    a = d, d = c, c = b, b += std::rotl(f, kTurns[i / 16][i % 4]);
  }
  state[0] += a, state[1] += b, state[2] += c, state[3] += d;
}

}  // namespace

std::array<std::uint8_t, 16> md5(ByteView bytes) {
  State state = {0x67452301, 0xefcdab89, 0x98badcfe, 0x10325476};
  const auto* data = static_cast<const std::uint8_t*>(bytes.data);
  std::size_t at = 0;
  for (; at + kBlock <= bytes.size; at += kBlock) add_block(state, data + at);
  // The rest, a 1, zeros, and the length in bits.
  std::array<std::uint8_t, 2 * kBlock> end{};
  const std::size_t rest = bytes.size - at;
  if (rest > 0) std::memcpy(end.data(), data + at, rest);
  end[rest] = 0x80;
  const std::size_t size = rest + 9 <= kBlock ? kBlock : 2 * kBlock;
  store(std::uint64_t(bytes.size) * 8, end.data() + size - 8);
  for (at = 0; at < size; at += kBlock) add_block(state, end.data() + at);
  std::array<std::uint8_t, 16> digest;
  for (std::size_t i = 0; i < 4; ++i) store(state[i], digest.data() + 4 * i);
  return digest;
}

}  // namespace tind
