#pragma once
// A binary arithmetic coder that learns: 32-bit range coder with carry (as in LZMA; [Martin79]),
// each bit with a probability that moves towards what came (12 bits of it are used).
//
// The decoder counts the bytes that it asked for. It has read a symbol for certain as long as it
// has not asked for one beyond the end: so a stream that is cut anywhere says by itself how far it
// can be trusted.

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

namespace tind::proto {

/// The probability of a 0, of 65536; the mean of a quick learner and of a slow one.
struct Bit {
  std::uint16_t quick = 1 << 15, slow = 1 << 15;

  std::uint32_t zero() const { return std::clamp((std::uint32_t(quick) + slow) >> 5, 1u, 4095u); }
  void learn(bool one) {
    if (one) {
      quick = std::uint16_t(quick - (quick >> 4));
      slow = std::uint16_t(slow - (slow >> 7));
    } else {
      quick = std::uint16_t(quick + ((65535 - quick) >> 4));
      slow = std::uint16_t(slow + ((65535 - slow) >> 7));
    }
  }
};

class RangeEncoder {
 public:
  explicit RangeEncoder(std::vector<std::uint8_t>& out) : out_(out) {}

  void bit(Bit& p, bool one) {
    const std::uint32_t split = (range_ >> 12) * p.zero();
    if (one) {
      low_ += split;
      range_ -= split;
    } else {
      range_ = split;
    }
    p.learn(one);
    while (range_ < 1u << 24) range_ <<= 8, shift();
  }
  /// `count` bits that are as likely as not, highest first.
  void bits(std::uint32_t value, int count) {
    while (count-- > 0) {
      range_ >>= 1;
      if (value >> count & 1) low_ += range_;
      while (range_ < 1u << 24) range_ <<= 8, shift();
    }
  }
  /// How many bytes a decoder that has read as far as this has asked for.
  std::size_t asked() const { return 4 + shifts_; }
  /// After the last bit, once.
  void finish() {
    for (int i = 0; i < 5; ++i) shift();
  }

 private:
  std::vector<std::uint8_t>& out_;
  std::uint64_t low_ = 0;
  std::uint32_t range_ = ~0u;
  std::uint8_t cache_ = 0;
  std::uint64_t pending_ = 0;  // bytes 255 that a carry would turn to 0
  bool first_ = true;
  std::size_t shifts_ = 0;

  void shift() {
    ++shifts_;
    if (low_ < 0xff000000u || low_ >> 32) {
      const auto carry = std::uint8_t(low_ >> 32);
      if (!first_) out_.push_back(std::uint8_t(cache_ + carry));
      first_ = false;
      for (; pending_ > 0; --pending_) out_.push_back(std::uint8_t(0xff + carry));
      cache_ = std::uint8_t(low_ >> 24);
    } else {
      ++pending_;
    }
    low_ = (low_ & 0x00ffffffu) << 8;
  }
};

class RangeDecoder {
 public:
  explicit RangeDecoder(std::span<const std::uint8_t> in) : in_(in) {
    for (int i = 0; i < 4; ++i) code_ = code_ << 8 | byte();
  }

  bool bit(Bit& p) {
    const std::uint32_t split = (range_ >> 12) * p.zero();
    const bool one = code_ >= split;
    if (one) {
      code_ -= split;
      range_ -= split;
    } else {
      range_ = split;
    }
    p.learn(one);
    while (range_ < 1u << 24) range_ <<= 8, code_ = code_ << 8 | byte();
    return one;
  }
  std::uint32_t bits(int count) {
    std::uint32_t value = 0;
    while (count-- > 0) {
      range_ >>= 1;
      const bool one = code_ >= range_;
      if (one) code_ -= range_;
      value = value << 1 | one;
      while (range_ < 1u << 24) range_ <<= 8, code_ = code_ << 8 | byte();
    }
    return value;
  }
  /// False once a byte beyond the end was needed.
  bool certain() const { return asked_ <= in_.size(); }
  std::size_t asked() const { return asked_; }

 private:
  std::span<const std::uint8_t> in_;
  std::size_t asked_ = 0;
  std::uint32_t range_ = ~0u, code_ = 0;

  std::uint32_t byte() { return asked_ < in_.size() ? in_[asked_++] : (++asked_, 0u); }
};

/// Whole numbers: the length of the magnitude in bits from a learnt tree, then its sign, its two
/// highest bits learnt and the others as they are. Below 2^31.
struct NumberModel {
  Bit length[64], sign[32], high[32][4];
};

template <class Coder>
class Numbers {  // the same walk for both directions: Coder::bit(p, value) or Coder::bit(p)
 public:
  explicit Numbers(Coder& coder) : coder_(coder) {}

  /// Encoding: returns v. Decoding: v is not looked at.
  std::int64_t number(NumberModel& m, std::int64_t v = 0, bool has_sign = true) {
    const auto magnitude = std::uint32_t(v < 0 ? -v : v);
    const int length = int(tree(m.length, 5, std::uint32_t(std::bit_width(magnitude))));
    if (length == 0) return 0;
    const bool negative = has_sign && bit(m.sign[length], v < 0);
    std::uint32_t got = 1;
    int left = length - 1;
    for (int i = 0; i < 2 && left > 0; ++i) {
      --left;
      got = got << 1 |
            std::uint32_t(bit(m.high[length][i == 0 ? 0 : 1 + (got & 1)], magnitude >> left & 1));
    }
    for (; left > 0;) {
      const int n = left < 16 ? left : 16;
      left -= n;
      got = got << n | raw(magnitude >> left, n);
    }
    return negative ? -std::int64_t(got) : std::int64_t(got);
  }
  std::uint32_t tree(Bit* nodes, int depth, std::uint32_t v = 0) {
    std::uint32_t node = 1;
    for (int i = depth; i-- > 0;) node = node << 1 | std::uint32_t(bit(nodes[node], v >> i & 1));
    return node - (1u << depth);
  }
  bool bit(Bit& p, bool one = false) {
    if constexpr (requires { coder_.certain(); }) {
      return coder_.bit(p);
    } else {
      coder_.bit(p, one);
      return one;
    }
  }
  std::uint32_t raw(std::uint32_t v, int n) {
    const std::uint32_t mask = n == 32 ? ~0u : (1u << n) - 1;
    if constexpr (requires { coder_.certain(); }) {
      return coder_.bits(n);
    } else {
      coder_.bits(v & mask, n);
      return v & mask;
    }
  }

 private:
  Coder& coder_;
};

}  // namespace tind::proto
