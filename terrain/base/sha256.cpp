#include "terrain/base/sha256.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace tind {
namespace {

using State = std::array<std::uint32_t, 8>;
constexpr std::size_t kBlock = 64;

/// The first 32 bits of the fractions of the cube roots of the first 64 primes.
constexpr std::uint32_t kRound[64] = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

void add_block(State& state, const std::uint8_t* block) {
  using std::rotr;
  std::uint32_t w[64];
  for (int i = 0; i < 16; ++i) w[i] = load<std::uint32_t, std::endian::big>(block + 4 * i);
  for (int i = 16; i < 64; ++i) {
    const std::uint32_t s0 = rotr(w[i - 15], 7) ^ rotr(w[i - 15], 18) ^ w[i - 15] >> 3;
    const std::uint32_t s1 = rotr(w[i - 2], 17) ^ rotr(w[i - 2], 19) ^ w[i - 2] >> 10;
    w[i] = w[i - 16] + s0 + w[i - 7] + s1;
  }
  auto [a, b, c, d, e, f, g, h] = state;
  for (int i = 0; i < 64; ++i) {
    const std::uint32_t s1 = rotr(e, 6) ^ rotr(e, 11) ^ rotr(e, 25);
    const std::uint32_t t1 = h + s1 + ((e & f) ^ (~e & g)) + kRound[i] + w[i];
    const std::uint32_t s0 = rotr(a, 2) ^ rotr(a, 13) ^ rotr(a, 22);
    const std::uint32_t t2 = s0 + ((a & b) ^ (a & c) ^ (b & c));
    h = g, g = f, f = e, e = d + t1, d = c, c = b, b = a, a = t1 + t2;
  }
  const State more = {a, b, c, d, e, f, g, h};
  for (std::size_t i = 0; i < state.size(); ++i) state[i] += more[i];
}

}  // namespace

void Sha256Sum::add(ByteView bytes) {
  const auto* data = static_cast<const std::uint8_t*>(bytes.data);
  std::size_t left = bytes.size;
  const std::size_t held = std::size_t(size_ % kBlock);
  size_ += left;
  if (held > 0) {
    const std::size_t more = std::min(left, kBlock - held);
    if (more > 0) std::memcpy(rest_.data() + held, data, more);
    if (held + more < kBlock) return;
    add_block(state_, rest_.data());
    data += more, left -= more;
  }
  for (; left >= kBlock; left -= kBlock, data += kBlock) add_block(state_, data);
  if (left > 0) std::memcpy(rest_.data(), data, left);
}

Sha256 Sha256Sum::finish() {
  // The rest, a one, zeros, and the length in bits.
  std::uint8_t last[2 * kBlock] = {};
  const std::size_t rest = std::size_t(size_ % kBlock), blocks = rest + 9 <= kBlock ? 1 : 2;
  if (rest > 0) std::memcpy(last, rest_.data(), rest);
  last[rest] = 0x80;
  store<std::endian::big>(size_ * 8, last + blocks * kBlock - 8);
  for (std::size_t i = 0; i < blocks; ++i) add_block(state_, last + i * kBlock);
  Sha256 hash;
  for (std::size_t i = 0; i < state_.size(); ++i)
    store<std::endian::big>(state_[i], hash.data() + 4 * i);
  return hash;
}

Sha256 sha256(ByteView bytes) {
  Sha256Sum sum;
  sum.add(bytes);
  return sum.finish();
}

std::string hex_of(const Sha256& hash) {
  std::string text;
  for (const std::uint8_t byte : hash)
    (text += "0123456789abcdef"[byte >> 4]) += "0123456789abcdef"[byte & 15];
  return text;
}

}  // namespace tind
