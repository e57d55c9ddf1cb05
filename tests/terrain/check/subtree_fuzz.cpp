// A number of levels and any bytes as a .subtree: an error, or bits that can all be asked for; and
// what they say can be written by tind and is read again as the same.

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "proto/tile/tiles3d.h"
#include "terrain/check/subtree.h"
#include "tests/support/fuzz_bytes.h"

namespace {

using tind::ReadSubtree;
using tind::test::require;

constexpr int kMostWritten = 5;  // levels; a tile takes a hundred bytes

std::uint64_t count(const tind::SubtreeBits& bits, std::uint64_t of) {
  std::uint64_t set = 0;
  for (std::uint64_t i = 0; i < of; ++i) set += bits.at(i);
  return set;
}

void require_alike(const tind::SubtreeBits& a, const tind::SubtreeBits& b, std::uint64_t of) {
  for (std::uint64_t i = 0; i < of; ++i)
    require(a.at(i) == b.at(i), "a bit is another after writing");
}

/// tind writes contents wherever there are tiles, and nothing without a tile.
void write_and_read(const ReadSubtree& read, int levels) {
  const std::uint64_t tiles = tind::tiles_in_subtree(levels);
  const std::uint64_t below = std::uint64_t(1) << 2 * levels;
  tind::proto::Subtree subtree;
  for (std::uint64_t i = 0; i < tiles; ++i) {
    subtree.tiles.emplace_back();
    if (read.tiles.at(i)) subtree.tiles.back().emplace();
  }
  for (std::uint64_t i = 0; i < below; ++i) subtree.children.push_back(read.children.at(i));
  const auto bytes = encode(subtree);
  const auto again =
      tind::read_subtree({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, levels);
  require(again.has_value(), "what tind writes is not read");
  require_alike(again->tiles, read.tiles, tiles);
  require_alike(again->contents, read.tiles, tiles);
  require_alike(again->children, read.children, below);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const int levels = 1 + data[0] % tind::kMostSubtreeLevels;
  const auto read = tind::read_subtree({reinterpret_cast<const char*>(data + 1), size - 1}, levels);
  if (!read) {
    require(!read.error().what.empty(), "an error says nothing");
    return 0;
  }
  const std::uint64_t tiles = tind::tiles_in_subtree(levels);
  const std::uint64_t there = count(read->tiles, tiles);
  require(there <= tiles && count(read->contents, tiles) <= tiles, "more bits than tiles");
  require(count(read->children, std::uint64_t(1) << 2 * levels) <= std::uint64_t(1) << 2 * levels,
          "more bits than subtrees");
  if (levels <= kMostWritten && there > 0) write_and_read(*read, levels);
  return 0;
}
