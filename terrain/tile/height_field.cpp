#include "terrain/tile/height_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace tind {

namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr int kFillReach = 64, kFillFlat = 16;  // posts

/// A place that is a post but for rounding is that post: its neighbours, void perhaps, have no say.
double on_post(double t) { return std::abs(t - std::round(t)) < 1e-6 ? std::round(t) : t; }

/// nw, ne, sw, se: the four posts; s, t: shares of the way to the east and to the south.
double blend(double nw, double ne, double sw, double se, double s, double t) {
  const int voids = std::isnan(nw) + std::isnan(ne) + std::isnan(sw) + std::isnan(se);
  if (voids == 0) return (nw * (1 - s) + ne * s) * (1 - t) + (sw * (1 - s) + se * s) * t;
  // On a grid line or a post only the posts that carry weight matter.
  if (s == 0 && t == 0) return nw;
  if (t == 0) return nw * (1 - s) + ne * s;
  if (s == 0) return nw * (1 - t) + sw * t;
  if (voids > 1) return kNothing;
  // A plane over the three valid corners, and only inside their triangle.
  if (std::isnan(nw)) return s + t >= 1 ? se + (1 - s) * (sw - se) + (1 - t) * (ne - se) : kNothing;
  if (std::isnan(se)) return s + t <= 1 ? nw + s * (ne - nw) + t * (sw - nw) : kNothing;
  if (std::isnan(ne)) return t >= s ? sw + s * (se - sw) + (1 - t) * (nw - sw) : kNothing;
  return s >= t ? ne + (1 - s) * (nw - ne) + t * (se - ne) : kNothing;
}

}  // namespace

Result<void> HeightField::load(std::int64_t col, std::int64_t row, int cols, int rows) {
  auto grid = source_.read(col, row, cols, rows);
  if (!grid) return std::unexpected(grid.error());
  window_ = std::move(*grid);
  col_ = col;
  row_ = row;
  return {};
}

double HeightField::at_post(Vec2 post) const {
  if (std::isnan(post.x) || std::isnan(post.y)) return kNothing;
  post = {on_post(post.x), on_post(post.y)};
  const double max_col = double(info_.cols - 1), max_row = double(info_.rows - 1);
  if (!(post.y >= -0.5 && post.y <= max_row + 0.5)) return kNothing;
  post.y = std::clamp(post.y, 0.0, max_row);
  if (!info_.wraps_longitude) {
    if (!(post.x >= -0.5 && post.x <= max_col + 0.5)) return kNothing;
    post.x = std::clamp(post.x, 0.0, max_col);
  }
  std::int64_t c = std::int64_t(std::floor(post.x)), r = std::int64_t(std::floor(post.y));
  if (!info_.wraps_longitude)
    c = std::clamp<std::int64_t>(c, 0, std::max<std::int64_t>(0, info_.cols - 2));
  r = std::clamp<std::int64_t>(r, 0, std::max<std::int64_t>(0, info_.rows - 2));
  const double s = post.x - double(c), t = post.y - double(r);
  const std::int64_t period = info_.wraps_longitude ? std::llround(info_.period_cols) : 0;
  for (const std::int64_t shift : {std::int64_t(0), period, -period}) {
    const std::int64_t i = c + shift - col_, j = r - row_;
    if (i >= 0 && j >= 0 && i + 1 < window_.cols() && j + 1 < window_.rows()) {
      return blend(window_.at(int(i), int(j)), window_.at(int(i) + 1, int(j)),
                   window_.at(int(i), int(j) + 1), window_.at(int(i) + 1, int(j) + 1), s, t);
    }
    if (period == 0) break;
  }
  const auto four = source_.read(c, r, 2, 2);
  if (!four) {
    if (!error_) error_ = four.error();
    return kNothing;
  }
  return blend(four->at(0, 0), four->at(1, 0), four->at(0, 1), four->at(1, 1), s, t);
}

void HeightField::at(std::span<const Geographic> places, std::span<double> heights) const {
  std::vector<Vec2> posts(places.size());
  source_.to_post(places, posts);
  for (std::size_t i = 0; i < posts.size(); ++i) heights[i] = at_post(posts[i]);
}

double HeightField::filled(Geographic place, double h) const {
  if (!std::isnan(h)) return h;
  Vec2 post;
  source_.to_post({&place, 1}, {&post, 1});
  const bool near = post.x >= -kFillReach && post.y >= -kFillReach &&
                    post.x <= double(info_.cols + kFillReach) &&
                    post.y <= double(info_.rows + kFillReach);
  if (!near) return 0;  // (not near either: NaN, where the projection cannot say)
  const std::int64_t c = std::llround(post.x), r = std::llround(post.y);
  for (int reach = 4; reach <= kFillReach; reach *= 4) {
    const auto around = source_.read(c - reach, r - reach, 2 * reach + 1, 2 * reach + 1);
    if (!around) {
      if (!error_) error_ = around.error();
      return 0;
    }
    double best = (reach + 0.5) * (reach + 0.5), height = 0;  // squared
    for (int j = 0; j < around->rows(); ++j) {
      const double dy = double(r + j - reach) - post.y;
      if (dy * dy >= best) continue;
      for (int i = 0; i < around->cols(); ++i) {
        const double dx = double(c + i - reach) - post.x, d = dx * dx + dy * dy;
        if (d < best && !around->is_void(i, j)) best = d, height = around->at(i, j);
      }
    }
    const double distance = std::sqrt(best);
    if (distance <= reach)
      return height * std::min(1.0, (kFillReach - distance) / (kFillReach - kFillFlat));
  }
  return 0;
}

}  // namespace tind
