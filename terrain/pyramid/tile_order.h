#pragma once
// The tiles of a plan by number. Not a list of them: of a large source that alone would take a
// hundred megabytes.

#include <cstddef>

#include "terrain/pyramid/level_plan.h"

namespace tind {

/// The deepest level first, each as TileArea counts: from north to south, as rasters lie. The plan
/// must outlive it.
class TileOrder {
 public:
  explicit TileOrder(const TilePlan& plan) : plan_(plan), size_(plan.tile_count()) {}
  std::size_t size() const { return size_; }
  /// REQUIRES: i < size().
  TileId operator[](std::size_t i) const {
    for (int z = plan_.last_level();; --z) {
      const TileArea& tiles = plan_.tiles(z);
      if (i < tiles.size()) {
        const auto [x, y] = tiles[i];
        return {z, x, y};
      }
      i -= tiles.size();
    }
  }

 private:
  const TilePlan& plan_;
  std::size_t size_;
};

}  // namespace tind
