#pragma once
// The tiles of a plan by number. Not a list of them: of a large source that alone would take a
// hundred megabytes.

#include <cstddef>

#include "terrain/pyramid/level_plan.h"

namespace tind {

/// The deepest level first, each from north to south, as rasters lie. The plan must outlive it.
class TileOrder {
 public:
  explicit TileOrder(const TilePlan& plan) : plan_(plan), size_(plan.tile_count()) {}
  std::size_t size() const { return size_; }
  /// REQUIRES: i < size().
  TileId operator[](std::size_t i) const {
    for (int z = plan_.max_level();; --z) {
      const proto::TileRange r = plan_.tiles(z);
      const std::size_t cols = r.end_x - r.start_x + 1, rows = r.end_y - r.start_y + 1;
      if (i < cols * rows)
        return {z, r.start_x + std::uint32_t(i % cols), r.end_y - std::uint32_t(i / cols)};
      i -= cols * rows;
    }
  }

 private:
  const TilePlan& plan_;
  std::size_t size_;
};

}  // namespace tind
