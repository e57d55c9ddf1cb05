#pragma once
// Which tiles of the pyramid exist: those over data, and no others.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "terrain/geo/tiling_scheme.h"

namespace tind {

/// A rectangle of tiles of one level, both ends included; rows from the south.
struct TileRange {
  std::uint32_t west = 0, south = 0, east = 0, north = 0;
  friend auto operator<=>(const TileRange&, const TileRange&) = default;

  std::uint64_t columns() const { return std::uint64_t(east) - west + 1; }
  std::uint64_t size() const { return columns() * (std::uint64_t(north) - south + 1); }
};

/// Tiles of one level that share more than a side with a rectangle; of one without area, the tile
/// that it is in.
TileRange tiles_over(const GeoRect&, int level);

/// A set of tiles of one level: rectangles that do not overlap, in one order, whatever it was made
/// of. The level is cut into bands of rows with the same columns; the northernmost band is the
/// first, and in a band the westernmost rectangle.
class TileArea {
 public:
  TileArea() = default;
  /// Of any rectangles; they may overlap. O(n log n + n per band).
  explicit TileArea(std::vector<TileRange> ranges);

  std::span<const TileRange> ranges() const { return ranges_; }
  std::uint64_t size() const { return before_.empty() ? 0 : before_.back(); }
  /// O(log of the number of rectangles), as the next.
  bool contains(std::uint32_t x, std::uint32_t y) const;
  /// The tile of number i, column and row: rectangle by rectangle, each from north to south, rows
  /// from west to east. REQUIRES: i < size().
  std::pair<std::uint32_t, std::uint32_t> operator[](std::uint64_t i) const;
  /// What of it lies in a rectangle.
  std::vector<TileRange> within(const TileRange&) const;

 private:
  std::vector<TileRange> ranges_;
  std::vector<std::uint64_t> before_;  // tiles of the rectangles up to each, that one included
};

}  // namespace tind
