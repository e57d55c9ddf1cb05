#pragma once
// A hash for each block of posts of a source, kept beside the tiles that were made from it. An
// update compares them with the DEM of today and so finds the blocks that have changed.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"

namespace tind {

/// A hash of each block of side() x side() posts: 16, or more where that would be too many blocks.
class SourceBlocks {
 public:
  explicit SourceBlocks(const DemInfo&);

  /// Posts from (col, row) on, whole blocks but at the source's ends. Thread-safe for others.
  void add(std::int64_t col, std::int64_t row, const HeightGrid&);

  /// The same of posts that are all void.
  void add_void(std::int64_t col, std::int64_t row, int cols, int rows);

  int side() const { return side_; }
  std::int64_t across() const { return across_; }
  std::int64_t down() const { return down_; }
  std::size_t size() const { return hashes_.size(); }

  /// Is some post of the block void?
  bool has_void(std::int64_t i, std::int64_t j) const { return hash(i, j) & 1; }
  /// Of the posts that the block has; one beyond the grid has none.
  bool all_void(std::int64_t i, std::int64_t j) const;
  /// Is a block not the same in two grids that begin at the same post and may end elsewhere? What
  /// is beyond one is void there. REQUIRES: the same side().
  bool differs(std::int64_t i, std::int64_t j, const SourceBlocks&) const;
  std::int64_t cols() const { return cols_; }
  std::int64_t rows() const { return rows_; }

  /// 32 digits that stand for every post.
  std::string digest() const;
  std::string encode() const;
  /// How the blocks of several layers begin (surface/surface_blocks.h).
  static constexpr std::string_view kLayersMagic{"TNSB\2\0\0\0", 8};
  /// Is it what encode() made of blocks with this digest, whatever the grid, or of several layers?
  static bool whole(std::string_view bytes, const std::string& digest);
  /// Fails with bad_data unless it is what encode() made for this grid and has this digest.
  static Result<SourceBlocks> decode(std::string_view bytes, const DemInfo&,
                                     const std::string& digest);

 private:
  int side_ = 16;
  std::int64_t cols_ = 0, rows_ = 0;
  std::int64_t across_ = 0, down_ = 0;
  std::vector<std::uint64_t> hashes_;  // row by row; the lowest bit says that there is a void

  std::uint64_t hash(std::int64_t i, std::int64_t j) const {
    return hashes_[std::size_t(j * across_ + i)];
  }
};

}  // namespace tind
