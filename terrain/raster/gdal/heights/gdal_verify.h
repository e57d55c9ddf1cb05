#pragma once
// Finds damage in raster files that GDAL reads without an error.

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
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
  /// `bands`: whose blocks are read; of bands that share their blocks, one. Does nothing for other
  /// formats and compressions. REQUIRES: at least one band.
  BlockSums(GDALDataset& set, std::vector<int> bands);
  ~BlockSums();

  /// Of the blocks under a window of posts; `real` is the file behind `set`.
  Result<void> check(GDALDataset& set, const std::string& real, int col, int row, int cols,
                     int rows) const;

 private:
  /// Which of so many blocks are known to be good. Made when the first of them is: a header can
  /// claim billions that the file does not hold.
  static constexpr std::uint64_t kPage = 16384;
  using Page = std::array<std::atomic<bool>, kPage>;

  /// False where the block is not in the file: there is nothing to be good.
  Result<bool> check_block(GDALDataset& set, const std::string& real, int band, int x, int y) const;
  std::atomic<bool>& good(std::uint64_t block) const;

  std::vector<int> bands_;
  int block_cols_ = 0, block_rows_ = 0;
  std::uint64_t across_ = 0, of_band_ = 0;  // blocks
  std::size_t block_bytes_ = 0;
  mutable std::vector<std::atomic<Page*>> pages_;  // empty: nothing to check
};

/// An Arc/Info ASCII grid must be numbers, as many as `posts`: GDAL takes anything else as 0. Where
/// it takes all for `whole` ones, of 32 bits, so must they be: of "nan" it makes 0 there, too.
Result<void> check_ascii_grid(const std::string& real, std::int64_t posts, bool whole);

/// The posts of an Erdas .img may lie in an .ige beside it, which GDAL reads as 0 behind its end:
/// it must be as long as its blocks. Those are not compressed.
Result<void> check_spill(GDALDataset& set);

}  // namespace tind::gdal
