#pragma once
// Damage that GDAL reads over without a word.

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/result.h"

class GDALDataset;

namespace tind::gdal {

/// Checks the Adler-32 of DEFLATE blocks of a GeoTIFF, each once. (libtiff stops reading a block
/// when it has enough bytes and so never compares the sum behind them: one of eight flipped bits
/// goes through as other heights.) Thread-safe.
class BlockSums {
 public:
  /// Does nothing for other formats and compressions.
  explicit BlockSums(GDALDataset& set);

  /// Of the blocks under a window of posts; `real` is the file behind `set`.
  Result<void> check(GDALDataset& set, const std::string& real, int col, int row, int cols,
                     int rows) const;

 private:
  Result<void> check_block(GDALDataset& set, const std::string& real, int x, int y) const;

  int block_cols_ = 0, block_rows_ = 0, across_ = 0;
  std::size_t block_bytes_ = 0;
  mutable std::vector<std::atomic<bool>> good_;  // empty: nothing to check
};

/// An Arc/Info ASCII grid must be numbers, as many as `posts`: GDAL takes anything else as 0.
Result<void> check_ascii_grid(const std::string& real, std::int64_t posts);

}  // namespace tind::gdal
