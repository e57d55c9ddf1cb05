#pragma once
// Reads a .subtree of implicit tiling (quadtrees) by anyone: OGC 22-025r4 (3D Tiles 1.1), 7.1, as
// its text says and not as tind writes it.

#include <cstdint>
#include <string_view>

#include "terrain/base/result.h"

namespace tind {

/// Bits of a subtree, all alike or one each. Looks into the bytes that it was read from.
class SubtreeBits {
 public:
  SubtreeBits() = default;
  explicit SubtreeBits(bool all) : all_(all) {}
  /// One bit each, the lowest of a byte first. REQUIRES: a byte at least.
  explicit SubtreeBits(std::string_view bits) : bits_(bits) {}

  /// REQUIRES: `i` is below the count that was read for.
  bool at(std::uint64_t i) const {
    return bits_.empty() ? all_ : (std::uint8_t(bits_[i / 8]) >> (i % 8) & 1) != 0;
  }

 private:
  bool all_ = false;
  std::string_view bits_;
};

struct ReadSubtree {
  /// Level by level, each by Morton numbers: tiles_in_subtree() of them. Contents are those of the
  /// first kind; none where the subtree says none.
  SubtreeBits tiles, contents;
  /// On the level below the last, 4^levels.
  SubtreeBits children;
};

inline constexpr int kMostSubtreeLevels = 10;  // a million tiles

/// (4^levels - 1) / 3.
constexpr std::uint64_t tiles_in_subtree(int levels) {
  return ((std::uint64_t(1) << 2 * levels) - 1) / 3;
}

/// Bits of x and y in turn, x the lowest.
std::uint64_t subtree_morton(std::uint64_t x, std::uint64_t y);

/// Good as long as `bytes` are. bad_data, with what is wrong as the rest of a sentence ("is no
/// subtree"). REQUIRES: levels from 1 to kMostSubtreeLevels.
Result<ReadSubtree> read_subtree(std::string_view bytes, int levels);

}  // namespace tind
