// Posts are asked for in batches, because the surface below is: first all valid posts that have a
// say, then the means, then the places. What is known of posts is kept.

#include "terrain/surface/layer_blend.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_set>

namespace tind {

namespace {

constexpr int kBlock = 64;                  // posts a side
constexpr std::size_t kMostKept = 1 << 20;  // posts, of each kind
constexpr std::size_t kMostBlocks = 256;    // of up to 192 x 192 posts
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

std::int64_t floor_div(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0); }

/// As in layer_field.cpp: a place that is a post but for rounding is that post.
double on_post(double t) { return std::abs(t - std::round(t)) < 1e-6 ? std::round(t) : t; }

double bilinear(const std::array<double, 4>& z, double fx, double fy) {
  const double north = z[0] + (z[1] - z[0]) * fx, south = z[2] + (z[3] - z[2]) * fx;
  return north + (south - north) * fy;
}

/// Over the triangle of corner `at` and its two neighbours in the cell.
double linear(const std::array<double, 4>& z, std::size_t at, double fx, double fy) {
  const std::size_t across = at ^ 1, down = at ^ 2;
  const double x = at % 2 == 0 ? fx : 1 - fx, y = at < 2 ? fy : 1 - fy;
  return z[at] + (z[across] - z[at]) * x + (z[down] - z[at]) * y;
}

}  // namespace

LayerBlend::LayerBlend(const SurfaceLayer& layer)
    : source_(*layer.source),
      info_(source_.info()),
      spacing_m_(layer.spacing_m),
      blend_m_(layer.blend_m) {
  reach_cols_ = int(std::floor(blend_m_ / spacing_m_.x));
  reach_rows_ = int(std::floor(blend_m_ / spacing_m_.y));
}

bool LayerBlend::near(Vec2 p) const {
  if (!(blend_m_ > 0)) return false;
  const bool in_rows = p.y >= -double(reach_rows_) - 1 && p.y <= double(info_.rows + reach_rows_);
  return in_rows && (info_.wraps_longitude ? std::isfinite(p.x)
                                           : p.x >= -double(reach_cols_) - 1 &&
                                                 p.x <= double(info_.cols + reach_cols_));
}

LayerBlend::Post LayerBlend::normal(Post p) const {
  if (!info_.wraps_longitude) return p;
  const std::int64_t period = std::llround(info_.period_cols);
  p.col -= floor_div(p.col, period) * period;
  return p;
}

void LayerBlend::find_nearest(Block& block, int none_in_row, int none_in_column) {
  const int width = block.around.cols(), height = block.around.rows();
  const auto values = block.around.values();
  for (auto* far : {&block.left, &block.right, &block.up, &block.down}) far->resize(values.size());
  // Away from a line's end, post by post.
  const auto walk = [&](std::vector<std::int16_t>& far, int first, int step, int count, int none) {
    std::int16_t n = std::int16_t(none);
    for (int k = 0, at = first; k < count; ++k, at += step) {
      n = std::isnan(values[std::size_t(at)]) ? std::min(std::int16_t(none), std::int16_t(n + 1))
                                              : std::int16_t(0);
      block.any |= n == 0;
      far[std::size_t(at)] = n;
    }
  };
  for (int r = 0; r < height; ++r) {
    walk(block.left, r * width, 1, width, none_in_row);
    walk(block.right, (r + 1) * width - 1, -1, width, none_in_row);
  }
  for (int c = 0; c < width; ++c) {
    walk(block.up, c, width, height, none_in_column);
    walk(block.down, (height - 1) * width + c, -width, height, none_in_column);
  }
}

Result<std::shared_ptr<const LayerBlend::Block>> LayerBlend::block_of(Post p) {
  const Post first{floor_div(p.col, kBlock) * kBlock, floor_div(p.row, kBlock) * kBlock};
  if (const auto found = blocks_.find(key(first)); found != blocks_.end()) return found->second;
  const int width = kBlock + 2 * reach_cols_, height = kBlock + 2 * reach_rows_;
  auto grid = source_.read(first.col - reach_cols_, first.row - reach_rows_, width, height);
  if (!grid) return std::unexpected(grid.error());
  auto block = std::make_shared<Block>();
  block->around = std::move(*grid);
  find_nearest(*block, reach_cols_ + 1, reach_rows_ + 1);
  if (blocks_.size() >= kMostBlocks) blocks_.clear();
  blocks_[key(first)] = block;
  return block;
}

/// REQUIRES: the block of the post.
float LayerBlend::own_height(const Block& block, Post p) const {
  return block.around.at(int(p.col - floor_div(p.col, kBlock) * kBlock) + reach_cols_,
                         int(p.row - floor_div(p.row, kBlock) * kBlock) + reach_rows_);
}

/// f(post, distance in metres): the nearest valid posts to the left and to the right in each row,
/// above and below in each column.
template <class F>
void LayerBlend::each_near(const Block& block, Post p, F&& f) const {
  if (!block.any) return;
  const int c = int(p.col - floor_div(p.col, kBlock) * kBlock) + reach_cols_,
            r = int(p.row - floor_div(p.row, kBlock) * kBlock) + reach_rows_;
  const auto width = std::size_t(block.around.cols());
  const double across = spacing_m_.x, down = spacing_m_.y, most = blend_m_ * blend_m_;
  const auto one = [&](int dx, int dy) {
    const double x = dx * across, y = dy * down, square = x * x + y * y;
    if (square < most) f(Post{p.col + dx, p.row + dy}, std::sqrt(square));
  };
  for (int dy = -reach_rows_; dy <= reach_rows_; ++dy) {
    const std::size_t at = std::size_t(r + dy) * width + std::size_t(c);
    const int left = block.left[at], right = block.right[at];
    if (left <= reach_cols_) one(-left, dy);
    if (left > 0 && right <= reach_cols_) one(right, dy);
  }
  for (int dx = -reach_cols_; dx <= reach_cols_; ++dx) {
    const std::size_t at = std::size_t(r) * width + std::size_t(c + dx);
    const int up = block.up[at], low = block.down[at];
    if (up <= reach_rows_) one(dx, -up);
    if (up > 0 && low <= reach_rows_) one(dx, low);
  }
}

/// Asks the surface below at valid posts. REQUIRES: nothing is known of any yet, each named once.
Result<void> LayerBlend::learn(std::span<const Post> posts, const Below& below) {
  if (posts.empty()) return {};
  std::vector<Vec2> at;
  for (const Post& p : posts) at.push_back({double(p.col), double(p.row)});
  std::vector<Geographic> places(at.size());
  source_.to_geographic(at, places);
  std::vector<double> heights(at.size()), shares(at.size());
  below(places, heights, shares);
  for (std::size_t i = 0; i < posts.size(); ++i) {
    const auto block = block_of(posts[i]);
    if (!block) return std::unexpected(block.error());
    known_[key(posts[i])] = {own_height(**block, posts[i]), heights[i], shares[i] >= 1};
  }
  return {};
}

/// REQUIRES: learn() of all that is near.
Result<double> LayerBlend::mean(Post p) {
  if (const auto found = means_.find(key(normal(p))); found != means_.end()) return found->second;
  const auto block = block_of(p);
  if (!block) return std::unexpected(block.error());
  double sum = 0, weights = 0, nearest = blend_m_;
  each_near(**block, p, [&](Post q, double d) {
    const auto known = known_.find(key(normal(q)));
    if (known == known_.end() || !known->second.counts) return;
    const double distance =
        std::max(d, 1e-3 * blend_m_);  // the post itself, where nothing is below
    const double w = 1 / distance - 1 / blend_m_;
    sum += w * w * known->second.correction();
    weights += w * w;
    nearest = std::min(nearest, distance);
  });
  const double t = nearest / blend_m_;
  const double correction = weights > 0 ? sum / weights * (1 - t) * (1 - t) * (1 + 2 * t) : 0;
  means_[key(normal(p))] = correction;
  return correction;
}

Result<void> LayerBlend::bend(std::span<const Vec2> posts, std::span<double> heights,
                              const Below& below) {
  if (known_.size() > kMostKept) known_.clear();
  if (means_.size() > kMostKept) means_.clear();
  struct Cell {
    Post first;
    double fx, fy;
  };
  std::vector<Cell> cells;
  std::vector<Post> needed;
  std::unordered_set<std::uint64_t> asked, seen, looked;  // posts, cells, corners
  const auto need = [&](Post p) {
    p = normal(p);
    if (!known_.contains(key(p)) && asked.insert(key(p)).second) needed.push_back(p);
  };
  for (const Vec2& post : posts) {
    const Vec2 p{on_post(post.x), on_post(post.y)};
    const Cell cell{{std::int64_t(std::floor(p.x)), std::int64_t(std::floor(p.y))},
                    p.x - std::floor(p.x),
                    p.y - std::floor(p.y)};
    cells.push_back(cell);
    if (!seen.insert(key(cell.first)).second) continue;
    std::size_t valid = 0;
    std::array<Post, 4> corners;
    for (std::size_t k = 0; k < 4; ++k) {
      corners[k] = {cell.first.col + std::int64_t(k % 2), cell.first.row + std::int64_t(k / 2)};
      const auto block = block_of(corners[k]);
      if (!block) return std::unexpected(block.error());
      valid += !std::isnan(own_height(**block, corners[k]));
      if (!means_.contains(key(normal(corners[k]))) && looked.insert(key(corners[k])).second)
        each_near(**block, corners[k], [&](Post q, double) { need(q); });
    }
    if (valid > 0) std::ranges::for_each(corners, need);
  }
  std::ranges::sort(needed);
  if (auto done = learn(needed, below); !done) return done;

  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto& [first, fx, fy] = cells[i];
    std::array<double, 4> correction{}, under{}, valid{};
    int voids = 0;
    std::size_t the_void = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const Post p{first.col + std::int64_t(k % 2), first.row + std::int64_t(k / 2)};
      const auto known = known_.find(key(normal(p)));
      const bool is_known =
          known != known_.end() && !std::isnan(known->second.height) && known->second.counts;
      if (is_known) {
        correction[k] = known->second.correction();
        valid[k] = 1;
      } else {
        const auto c = mean(p);
        if (!c) return std::unexpected(c.error());
        correction[k] = *c;
        ++voids, the_void = k;
      }
      if (known != known_.end()) under[k] = known->second.below;
    }
    const bool three = voids == 1;
    const auto between = [&](const std::array<double, 4>& z) {
      return three ? linear(z, the_void, fx, fy) : bilinear(z, fx, fy);
    };
    const double s = between(valid);
    heights[i] = between(correction) + (s > 0 ? s * between(under) : 0) + (1 - s) * heights[i];
  }
  return {};
}

}  // namespace tind
