#include "terrain/surface/layer_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "terrain/raster/interpolate.h"

namespace tind {

namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

/// A place that is a post but for rounding is that post: its neighbours, void perhaps, have no say.
double on_post(double t) { return std::abs(t - std::round(t)) < 1e-6 ? std::round(t) : t; }

}  // namespace

bool LayerField::Cell::whole() const { return !std::isnan(nw + ne + sw + se); }

double LayerField::Cell::height() const { return height_between(nw, ne, sw, se, fx, fy); }

Result<void> LayerField::load(std::int64_t col, std::int64_t row, int cols, int rows) {
  auto grid = source_.read(col, row, cols, rows);
  if (!grid) return std::unexpected(grid.error());
  window_ = std::move(*grid);
  col_ = col;
  row_ = row;
  return {};
}

std::optional<LayerField::Cell> LayerField::cell_at(Vec2 post) const {
  if (std::isnan(post.x) || std::isnan(post.y)) return {};
  post = {on_post(post.x), on_post(post.y)};
  const double max_col = double(info_.cols - 1), max_row = double(info_.rows - 1);
  if (!(post.y >= -0.5 && post.y <= max_row + 0.5)) return {};
  post.y = std::clamp(post.y, 0.0, max_row);
  if (!info_.wraps_longitude) {
    if (!(post.x >= -0.5 && post.x <= max_col + 0.5)) return {};
    post.x = std::clamp(post.x, 0.0, max_col);
  }
  std::int64_t c = std::int64_t(std::floor(post.x)), r = std::int64_t(std::floor(post.y));
  if (!info_.wraps_longitude)
    c = std::clamp<std::int64_t>(c, 0, std::max<std::int64_t>(0, info_.cols - 2));
  r = std::clamp<std::int64_t>(r, 0, std::max<std::int64_t>(0, info_.rows - 2));
  const double fx = post.x - double(c), fy = post.y - double(r);
  const std::int64_t period = info_.wraps_longitude ? std::llround(info_.period_cols) : 0;
  for (const std::int64_t shift : {std::int64_t(0), period, -period}) {
    const std::int64_t i = c + shift - col_, j = r - row_;
    if (i >= 0 && j >= 0 && i + 1 < window_.cols() && j + 1 < window_.rows()) {
      const float* north = &window_.row(int(j))[std::size_t(i)];
      const float* south = &window_.row(int(j) + 1)[std::size_t(i)];
      return Cell{north[0], north[1], south[0], south[1], fx, fy};
    }
    if (period == 0) break;
  }
  const auto four = source_.read(c, r, 2, 2);
  if (!four) {
    if (!error_) error_ = four.error();
    return {};
  }
  return Cell{four->at(0, 0), four->at(1, 0), four->at(0, 1), four->at(1, 1), fx, fy};
}

double LayerField::at_post(Vec2 post) const {
  const auto cell = cell_at(post);
  return cell ? cell->height() : kNothing;
}

void LayerField::at(std::span<const Geographic> places, std::span<double> heights) const {
  std::vector<Vec2> posts(places.size());
  source_.to_post(places, posts);
  for (std::size_t i = 0; i < posts.size(); ++i) heights[i] = at_post(posts[i]);
}

/// Bilinear over four posts, whatever they are; NaN where `around` does not reach far enough.
VoidFill::Post LayerField::filled_post(Vec2 post, const VoidFill* around) const {
  const auto c = std::int64_t(std::floor(post.x)), r = std::int64_t(std::floor(post.y));
  std::optional<VoidFill> own;
  if (!around || !around->covers(c, r) || !around->covers(c + 1, r + 1)) {
    auto fill = VoidFill::load(source_, c, r, 2, 2);
    if (!fill) {
      if (!error_) error_ = fill.error();
      return {};
    }
    around = &own.emplace(std::move(*fill));
  }
  const auto nw = around->post(c, r), ne = around->post(c + 1, r), sw = around->post(c, r + 1),
             se = around->post(c + 1, r + 1);
  if (std::isnan(nw.height + ne.height + sw.height + se.height))
    return {kNothing, kNothing};  // look farther
  const double fx = post.x - double(c), fy = post.y - double(r);
  return {height_between(nw.height, ne.height, sw.height, se.height, fx, fy),
          height_between(nw.share, ne.share, sw.share, se.share, fx, fy)};
}

/// One read for all of them, where that is not too much.
std::optional<VoidFill> LayerField::fill_around(std::span<const Vec2> posts, int reach) const {
  constexpr double kMost = 1 << 19;  // posts
  if (posts.size() < 2) return {};
  Vec2 low = posts[0], high = posts[0];
  for (const Vec2& p : posts) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  const double cols = std::floor(high.x) - std::floor(low.x) + 2;
  const double rows = std::floor(high.y) - std::floor(low.y) + 2;
  if ((cols + 2 * reach) * (rows + 2 * reach) > kMost) return {};
  auto fill = VoidFill::load(source_, std::int64_t(std::floor(low.x)),
                             std::int64_t(std::floor(low.y)), int(cols), int(rows), reach);
  if (fill) return std::move(*fill);
  if (!error_) error_ = fill.error();
  return {};
}

void LayerField::inside(std::span<const Geographic> places, std::span<double> heights,
                        std::span<Vec2> posts) const {
  source_.to_post(places, posts);
  for (std::size_t i = 0; i < posts.size(); ++i) {
    const Vec2 p{on_post(posts[i].x), on_post(posts[i].y)};
    const bool within = p.y >= 0 && p.y <= double(info_.rows - 1) &&
                        (info_.wraps_longitude || (p.x >= 0 && p.x <= double(info_.cols - 1)));
    heights[i] = within ? at_post(p) : kNothing;
  }
}

void LayerField::filled(std::span<const Geographic> places, std::span<double> heights,
                        std::span<double> shares) const {
  constexpr int kReach = VoidFill::kReach;
  std::vector<Vec2> posts(places.size()), missing;
  std::vector<std::size_t> where;
  source_.to_post(places, posts);
  for (std::size_t i = 0; i < posts.size(); ++i) {
    const Vec2 p = posts[i];
    const auto cell = cell_at(p);
    heights[i] = cell && cell->whole() ? cell->height() : 0;
    if (!shares.empty()) shares[i] = cell && cell->whole() ? 1 : 0;
    const bool near = p.x >= -kReach - 1 && p.y >= -kReach - 1 &&
                      p.x <= double(info_.cols + kReach) && p.y <= double(info_.rows + kReach);
    if ((cell && cell->whole()) || !near) continue;  // (NaN is not near: no projection there)
    missing.push_back({on_post(p.x), on_post(p.y)});
    where.push_back(i);
  }
  // Most voids are narrow: only what a short look around leaves open gets a long one.
  for (const int reach : {VoidFill::kReach / 4, VoidFill::kReach}) {
    const auto fill = fill_around(missing, reach);
    std::size_t open = 0;
    for (std::size_t k = 0; k < missing.size(); ++k) {
      const auto [h, share] = filled_post(missing[k], fill ? &*fill : nullptr);
      heights[where[k]] = h;
      if (!shares.empty()) shares[where[k]] = share;
      if (std::isnan(h)) missing[open] = missing[k], where[open++] = where[k];
    }
    missing.resize(open);
    where.resize(open);
  }
}

}  // namespace tind
