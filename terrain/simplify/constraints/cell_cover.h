#pragma once
// The cells of a height grid near lines: how much of each cell the DEM covers, and the edges where
// the covered area ends.

#include <array>
#include <cstdint>
#include <vector>

#include "terrain/mesh/tin.h"
#include "terrain/raster/height_grid.h"

namespace tind {

/// Post coordinates (x = col, y = -row). REQUIRES: a grid of at least 2 x 2 posts that outlives it.
class CellCover {
 public:
  using Post = std::array<int, 2>;  // col, row

  explicit CellCover(const HeightGrid& grid)
      : grid_(grid),
        cols_(grid.cols()),
        rows_(grid.rows()),
        marked_(std::size_t(cols_ - 1) * std::size_t(rows_ - 1), 0) {}

  bool valid(int c, int r) const { return !grid_.is_void(c, r); }
  bool marked(int c, int r) const { return marked_[cell(c, r)]; }
  void clear() { marked_.assign(marked_.size(), 0); }

  /// Marks the cells that the segment meets, and `around` more in each direction.
  void mark_along(const Vec3& a, const Vec3& b, int around);

  /// Is a cell at this post marked?
  bool at_marked(int c, int r) const;

  /// What of a cell the DEM covers: 4 corners, the 3 valid ones, or nothing; counter-clockwise.
  std::vector<Post> covered(int c, int r) const;

  /// In a marked cell, and covered?
  bool covers(const Vec3& p) const;

  /// f(post, post) for the edges between what is covered and what is not, of marked cells.
  template <class F>
  void for_each_rim(F&& f) const {
    for (int r = 0; r + 1 < rows_; ++r) {
      for (int c = 0; c + 1 < cols_; ++c) {
        if (!marked(c, r)) continue;
        const auto corners = covered(c, r);
        for (std::size_t k = 0; k < corners.size(); ++k) {
          const Post &p = corners[k], &q = corners[(k + 1) % corners.size()];
          if (is_rim(c, r, p, q)) f(p, q);
        }
      }
    }
  }

 private:
  const HeightGrid& grid_;
  int cols_, rows_;
  std::vector<std::uint8_t> marked_;

  std::size_t cell(int c, int r) const {
    return std::size_t(r) * std::size_t(cols_ - 1) + std::size_t(c);
  }
  void mark(const Vec3& a, const Vec3& b, int around);
  bool is_rim(int c, int r, const Post& p, const Post& q) const;
};

}  // namespace tind
