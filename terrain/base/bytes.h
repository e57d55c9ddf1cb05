#pragma once
// Numbers as bytes, the one way for every format: little endian unless said otherwise, variable
// lengths as LEB128, signed ones zig-zag before that. On the ground floor, so that proto may
// use it.

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace tind {

/// Bytes that somebody else holds, whatever they are held as: read only, one call long.
struct ByteView {
  const void* data;
  std::size_t size;

  ByteView(const void* bytes, std::size_t count) : data(bytes), size(count) {}
  ByteView(std::string_view text) : data(text.data()), size(text.size()) {}
  ByteView(const std::string& text) : data(text.data()), size(text.size()) {}
  ByteView(std::span<const std::uint8_t> bytes) : data(bytes.data()), size(bytes.size()) {}
  ByteView(const std::vector<std::uint8_t>& bytes) : data(bytes.data()), size(bytes.size()) {}
};

template <class T>
concept Number = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;

/// Writes sizeof(T) bytes.
template <std::endian Order = std::endian::little, Number T>
void store(T value, void* to) {
  auto bytes = std::bit_cast<std::array<unsigned char, sizeof(T)>>(value);
  if constexpr (Order != std::endian::native)
    for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(bytes[i], bytes[sizeof(T) - 1 - i]);
  std::memcpy(to, bytes.data(), sizeof(T));
}

/// Reads sizeof(T) bytes, wherever they lie.
template <Number T, std::endian Order = std::endian::little>
T load(const void* from) {
  std::array<unsigned char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), from, sizeof(T));
  if constexpr (Order != std::endian::native)
    for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(bytes[i], bytes[sizeof(T) - 1 - i]);
  return std::bit_cast<T>(bytes);
}

/// 0, -1, 1, -2, ... become 0, 1, 2, 3, ...: small magnitudes are small numbers.
constexpr std::uint64_t zigzag(std::int64_t v) {
  return (std::uint64_t(v) << 1) ^ std::uint64_t(v >> 63);
}
constexpr std::int64_t unzigzag(std::uint64_t code) {
  return std::int64_t(code >> 1) ^ -std::int64_t(code & 1);
}

/// Appends to `Bytes`, a vector of bytes or a string, which outlives it.
template <class Bytes = std::vector<std::uint8_t>>
class ByteWriter {
 public:
  explicit ByteWriter(Bytes& out) : out_(out) {}

  template <Number T>
  void put(T value) {
    const std::size_t at = out_.size();
    out_.resize(at + sizeof value);
    store(value, out_.data() + at);
  }
  void put_bytes(const void* data, std::size_t size) {
    const std::size_t at = out_.size();
    out_.resize(at + size);
    if (size > 0) std::memcpy(out_.data() + at, data, size);
  }
  void put_text(std::string_view text) { put_bytes(text.data(), text.size()); }
  void skip(std::size_t zeros) { out_.resize(out_.size() + zeros); }

  /// LEB128: seven bits a byte, the lowest first.
  void put_varint(std::uint64_t v) {
    for (; v >= 128; v >>= 7) put(std::uint8_t(v | 128));
    put(std::uint8_t(v));
  }
  void put_signed_varint(std::int64_t v) { put_varint(zigzag(v)); }

 private:
  Bytes& out_;
};

/// Reads what others wrote. What is not there reads as zero, and `good` says so from then on: a
/// reader of lists looks once an entry, not once a number.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  explicit ByteReader(std::string_view bytes)
      : bytes_(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()) {}

  template <Number T>
  T get() {
    const std::uint8_t* const from = take(sizeof(T));
    return from ? load<T>(from) : T{};
  }
  /// These view what it was given; empty when there are fewer.
  std::span<const std::uint8_t> get_bytes(std::size_t size) {
    const std::uint8_t* const from = take(size);
    return from ? std::span(from, size) : std::span<const std::uint8_t>();
  }
  std::string_view get_text(std::size_t size) {
    const std::uint8_t* const from = take(size);
    return from ? std::string_view(reinterpret_cast<const char*>(from), size) : std::string_view();
  }
  /// A number of at most `most_bytes` bytes (9 at the most): a longer one is refused.
  std::uint64_t get_varint(int most_bytes = 5) {
    std::uint64_t v = 0;
    for (int i = 0; i < most_bytes; ++i) {
      const auto b = get<std::uint8_t>();
      if (ended_) return 0;
      v |= std::uint64_t(b & 127) << (7 * i);
      if (b < 128) return v;
    }
    refuse();
    return 0;
  }
  std::int64_t get_signed_varint(int most_bytes = 5) { return unzigzag(get_varint(most_bytes)); }

  void refuse() { refused_ = true; }     // a number that its reader cannot accept
  bool ended() const { return ended_; }  // asked for more bytes than there are
  bool refused() const { return refused_; }
  bool good() const { return !ended_ && !refused_; }
  std::size_t left() const { return bytes_.size() - at_; }
  std::size_t at() const { return at_; }

 private:
  const std::uint8_t* take(std::size_t size) {
    if (size > left()) {
      ended_ = true;
      return nullptr;
    }
    const std::uint8_t* const from = bytes_.data() + at_;
    at_ += size;
    return from;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool ended_ = false, refused_ = false;
};

}  // namespace tind
