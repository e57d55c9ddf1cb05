#pragma once
// What a daemon and a process that decodes for it say to each other: one fixed struct each way over
// a socket that keeps packets whole, and beside it memory that both see. What comes from the
// decoder is taken for an attacker's: every number is checked before it is used, every length
// against the bytes that are there.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>

namespace tind::sandbox {

inline constexpr std::uint32_t kMagic = 0x64636f44;

/// The descriptors of a decoder when its program begins.
inline constexpr int kSocket = 3, kShared = 4, kBrief = 5;

/// Memory that both see: heights, or a text, then the posts that are asked for.
inline constexpr std::size_t kWindowPosts = 65536;
inline constexpr std::size_t kHeightBytes = kWindowPosts * sizeof(double);
inline constexpr std::size_t kSharedBytes = kHeightBytes + kWindowPosts * 2 * sizeof(std::int32_t);
/// Of what is written in words there.
inline constexpr std::size_t kMostText = 256 << 10, kMostMessage = 4096;
inline constexpr int kCounters = 8;

enum class Ask : std::uint32_t {
  open,   // file -> its facts, as text
  read,   // file, col, row, cols, rows -> heights
  posts,  // file, count; columns and rows of posts in the memory -> heights
  grid,   // file -> the first counter: whether it is a grid of offsets
};

struct Request {
  std::uint32_t magic = kMagic, number = 0;
  Ask ask = Ask::open;
  std::uint32_t file = 0;
  std::int32_t col = 0, row = 0, cols = 0, rows = 0;
  std::uint32_t count = 0;
};

/// `number`: that of the request; 0 for the first one, which says that the decoder is ready.
struct Reply {
  std::uint32_t magic = kMagic, number = 0;
  std::uint32_t status = 0;      // 0: done; else 1 + Errc, and the text says why
  std::uint32_t text_bytes = 0;  // in the memory
  std::uint32_t counted[kCounters] = {};
};
static_assert(std::is_trivially_copyable_v<Request> && sizeof(Request) == 36);
static_assert(std::is_trivially_copyable_v<Reply> && sizeof(Reply) == 16 + 4 * kCounters);

/// Values one after the other.
class Writer {
 public:
  template <class T>
  requires(std::is_arithmetic_v<T>) void put(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void put(std::string_view text) {
    put(std::uint32_t(text.size()));
    bytes_ += text;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// The same back. What is not there, or is longer than allowed, makes it bad for good; values are
/// then 0 and empty. REQUIRES: bytes that nobody else changes.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : left_(bytes) {}
  template <class T>
  requires(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) T number() {
    T value{};
    if (!has(sizeof value)) return value;
    std::memcpy(&value, left_.data(), sizeof value);
    left_.remove_prefix(sizeof value);
    return value;
  }
  bool flag() {
    const auto value = number<std::uint8_t>();
    if (value > 1) good_ = false;
    return value == 1;
  }
  /// A number of things of at least so many bytes each.
  std::size_t count(std::size_t each, std::size_t most) {
    const std::size_t n = number<std::uint32_t>();
    if (n > most || n > left_.size() / each) good_ = false;
    return good_ ? n : 0;
  }
  std::string text(std::size_t most) {
    const std::size_t n = count(1, most);
    std::string text(left_.substr(0, n));
    left_.remove_prefix(n);
    return text;
  }
  bool good() const { return good_; }
  /// Good, and nothing is left over.
  bool done() const { return good_ && left_.empty(); }

 private:
  bool has(std::size_t n) {
    if (left_.size() < n) good_ = false;
    return good_;
  }
  std::string_view left_;
  bool good_ = true;
};

}  // namespace tind::sandbox
