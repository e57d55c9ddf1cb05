// Nearest valid posts from one table: by row, how far the next valid post lies to the left and to
// the right (the first half of Felzenszwalb and Huttenlocher's distance transform). The columns'
// half is a short search, because few posts are asked for.

#include "terrain/surface/void_fill.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tind {

namespace {

/// Between files that lie far apart there is nothing to be read.
bool may_hold_posts(const DemInfo& info, std::int64_t col, std::int64_t row, int cols, int rows) {
  const std::int64_t turn = info.wraps_longitude ? std::llround(info.period_cols) : 0;
  const auto meets = [&](const PostRect& part) {
    if (row > part.last_row || row + rows <= part.row) return false;
    for (const std::int64_t first : {col, col - turn, col + turn})
      if (first <= part.last_col && first + cols > part.col) return true;
    return false;
  };
  if (info.covered.empty()) return meets({0, 0, info.cols - 1, info.rows - 1});
  return std::ranges::any_of(info.covered, meets);
}

}  // namespace

Result<VoidFill> VoidFill::load(const DemSource& source, std::int64_t col, std::int64_t row,
                                int cols, int rows, int reach) {
  VoidFill fill;
  fill.reach_ = reach;
  fill.col_ = col - reach;
  fill.row_ = row - reach;
  const int width = cols + 2 * reach, height = rows + 2 * reach;
  const auto none = std::int16_t(reach + 1);
  fill.all_void_ = !may_hold_posts(source.info(), fill.col_, fill.row_, width, height);
  if (fill.all_void_) {
    fill.around_ = HeightGrid(width, height);
    return fill;
  }
  auto grid = source.read(fill.col_, fill.row_, width, height);
  if (!grid) return std::unexpected(grid.error());
  fill.around_ = std::move(*grid);
  fill.all_void_ =
      std::ranges::all_of(fill.around_.values(), [](float z) { return std::isnan(z); });
  if (fill.all_void_) return fill;
  fill.left_.resize(fill.around_.size());
  fill.right_.resize(fill.around_.size());
  for (int r = 0; r < height; ++r) {
    const auto line = fill.around_.row(r);
    std::int16_t* left = &fill.left_[std::size_t(r) * width];
    std::int16_t* right = &fill.right_[std::size_t(r) * width];
    std::int16_t far = none;
    for (int c = 0; c < width; ++c) {
      far = std::isnan(line[c]) ? std::min<std::int16_t>(none, far + 1) : 0;
      left[c] = far;
    }
    far = none;
    for (int c = width; c-- > 0;) {
      far = std::isnan(line[c]) ? std::min<std::int16_t>(none, far + 1) : 0;
      right[c] = far;
    }
  }
  return fill;
}

bool VoidFill::covers(std::int64_t col, std::int64_t row) const {
  return col >= col_ + reach_ && row >= row_ + reach_ && col < col_ + around_.cols() - reach_ &&
         row < row_ + around_.rows() - reach_;
}

VoidFill::Post VoidFill::post(std::int64_t col, std::int64_t row) const {
  const double beyond = reach_ < kReach ? std::numeric_limits<double>::quiet_NaN() : 0;
  if (all_void_) return {beyond, beyond};
  const int c = int(col - col_), r = int(row - row_), width = around_.cols();
  int best = reach_ * reach_ + 1;  // squared distance
  float height = 0;
  for (int away = 0; away <= reach_ && away * away < best; ++away) {
    for (const int line : {r + away, r - away}) {
      const std::size_t at = std::size_t(line) * width + std::size_t(c);
      const int left = left_[at], right = right_[at], dx = std::min(left, right);
      if (dx > reach_ || dx * dx + away * away >= best) continue;
      best = dx * dx + away * away;
      height = around_.at(left <= right ? c - left : c + right, line);
    }
  }
  if (best > reach_ * reach_) return {beyond, beyond};
  const double distance = std::sqrt(double(best));
  const double share = std::min(1.0, (kReach - distance) / (kReach - kFlat));
  return {height * share, share};
}

Result<HeightGrid> fill_voids(const DemSource& source, HeightGrid posts, std::int64_t col,
                              std::int64_t row) {
  if (std::ranges::none_of(posts.values(), [](float z) { return std::isnan(z); })) return posts;
  const auto fill = VoidFill::load(source, col, row, posts.cols(), posts.rows());
  if (!fill) return std::unexpected(fill.error());
  std::vector<std::pair<int, int>> voids;
  for (int r = 0; r < posts.rows(); ++r)
    for (int c = 0; c < posts.cols(); ++c)
      if (posts.is_void(c, r)) voids.emplace_back(c, r);
  for (const auto& [c, r] : voids) posts.at(c, r) = float(fill->at(col + c, row + r));
  // Gauss-Seidel on Laplace's equation: a ramp over about ten posts, the valid ones held.
  constexpr int kSweeps = 64;
  const auto clamped = [&](int c, int r) {
    return posts.at(std::clamp(c, 0, posts.cols() - 1), std::clamp(r, 0, posts.rows() - 1));
  };
  for (int k = 0; k < kSweeps; ++k)
    for (const auto& [c, r] : voids)
      posts.at(c, r) =
          (clamped(c - 1, r) + clamped(c + 1, r) + clamped(c, r - 1) + clamped(c, r + 1)) / 4;
  return posts;
}

}  // namespace tind
