#pragma once
// A DEM's rows one after the other, from the north: read in strips.

#include <algorithm>
#include <cstdint>
#include <span>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// For one thread. The source is to outlive it.
class PostRows {
 public:
  explicit PostRows(const DemSource& source) : source_(source) {}

  /// All columns of a row; NaN for a void.
  Result<void> operator()(std::int64_t row, std::span<double> out) {
    if (row < first_ || row >= first_ + strip_.rows()) {
      const DemInfo& info = source_.info();
      const int count = int(std::min<std::int64_t>(kStrip, info.rows - row));
      auto strip = source_.read(0, row, int(info.cols), count);
      if (!strip) return std::unexpected(strip.error());
      strip_ = std::move(*strip);
      first_ = row;
    }
    std::ranges::copy(strip_.row(int(row - first_)), out.begin());
    return {};
  }

 private:
  static constexpr std::int64_t kStrip = 64;
  const DemSource& source_;
  HeightGrid strip_;
  std::int64_t first_ = 0;
};

}  // namespace tind
