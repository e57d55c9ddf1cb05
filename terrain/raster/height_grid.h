#pragma once
// Heights on a regular grid of posts, in memory.

#include <cassert>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace tind {

/// `rows` x `cols` heights in metres, row 0 is the first (northern) row. A void is NaN; a height is
/// always finite. Heights are float: exact for every integer or float32 metre source.
class HeightGrid {
 public:
  static constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();

  HeightGrid() = default;
  HeightGrid(int cols, int rows, float fill = kVoid)
      : cols_(cols), rows_(rows), z_(std::size_t(cols) * rows, fill) {}

  int cols() const { return cols_; }
  int rows() const { return rows_; }
  std::size_t size() const { return z_.size(); }
  bool inside(int col, int row) const { return col >= 0 && row >= 0 && col < cols_ && row < rows_; }

  float& at(int col, int row) { return z_[std::size_t(row) * cols_ + col]; }
  float at(int col, int row) const { return z_[std::size_t(row) * cols_ + col]; }
  bool is_void(int col, int row) const { return std::isnan(at(col, row)); }
  std::span<float> row(int r) { return {z_.data() + std::size_t(r) * cols_, std::size_t(cols_)}; }
  std::span<const float> row(int r) const {
    return {z_.data() + std::size_t(r) * cols_, std::size_t(cols_)};
  }
  std::span<const float> values() const { return z_; }
  std::span<float> values() { return z_; }

 private:
  int cols_ = 0, rows_ = 0;
  std::vector<float> z_;
};

}  // namespace tind
