#pragma once
// Numbers the tiles of several levels, so that a loop can run over them by index. It computes each
// tile from its number: for a large source, a list of tiles alone would take a hundred megabytes.

#include <cstddef>
#include <span>

#include "terrain/geo/availability.h"

namespace tind {

/// The deepest level first, each as TileArea counts: from north to south, as rasters lie. The areas
/// must outlive it.
class TileOrder {
 public:
  /// `areas`: one a level, from level 0 on; tiles of levels first..last have numbers.
  TileOrder(std::span<const TileArea> areas, int first, int last) : areas_(areas), last_(last) {
    for (int z = first; z <= last; ++z) size_ += areas[std::size_t(z)].size();
  }
  std::size_t size() const { return size_; }
  /// REQUIRES: i < size().
  TileId operator[](std::size_t i) const {
    for (int z = last_;; --z) {
      const TileArea& tiles = areas_[std::size_t(z)];
      if (i < tiles.size()) {
        const auto [x, y] = tiles[i];
        return {z, x, y};
      }
      i -= tiles.size();
    }
  }

 private:
  std::span<const TileArea> areas_;
  int last_;
  std::size_t size_ = 0;
};

}  // namespace tind
