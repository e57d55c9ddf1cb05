// Tensor-product cubic Lagrange interpolation of the projection, in cells of 48 x 48 posts that are
// fixed to the source (not to the window), so that a post has one position. Each cell is tried
// where the interpolation is worst; where it is off there (widely spaced posts, a pole), PROJ is
// asked for every post of the cell.

#include "terrain/surface/post_warp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace tind {

namespace {

constexpr int kNodeStep = 16, kCell = 3 * kNodeStep;
/// Where the error of cubic interpolation along a line has its three extremes, to the post.
constexpr std::array kTrials = {6, 24, 42};
/// Degrees of longitude or latitude, half a micrometre on the equator: trials that are off by more
/// show that the interpolation is not good enough.
constexpr double kGoodEnough = 4.5e-12;

std::int64_t floor_div(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0); }

/// Weights of the nodes at 0, 16, 32, 48 for each place 0..47.
std::array<std::array<double, 4>, kCell> lagrange_weights() {
  std::array<std::array<double, 4>, kCell> table{};
  for (int p = 0; p < kCell; ++p) {
    const double t = double(p) / kNodeStep;
    table[p] = {-(t - 1) * (t - 2) * (t - 3) / 6, t * (t - 2) * (t - 3) / 2,
                -t * (t - 1) * (t - 3) / 2, t * (t - 1) * (t - 2) / 6};
  }
  return table;
}

std::vector<Geographic> exact(const DemSource& source, const std::vector<Vec2>& posts) {
  std::vector<Geographic> out(posts.size());
  source.to_geographic(posts, out);
  return out;
}

/// Longitudes that differ by less than half a turn from `near`: a cell over the antimeridian is as
/// smooth as any.
double unwrapped(double lon, double near) {
  return std::abs(lon - near) > 180 ? lon + 360 * std::round((near - lon) / 360) : lon;
}

/// -180 <= lon < 180.
double normal(double lon) {
  if (lon < -180) return lon + 360;
  return lon < 180 ? lon : lon - 360;
}

class Cell {
 public:
  /// `nodes`: the first of 4 x 4, in rows of `stride`.
  Cell(const Geographic* nodes, std::int64_t stride) {
    for (int k = 0; k < 4; ++k)
      for (int i = 0; i < 4; ++i) {
        nodes_[k][i] = nodes[k * stride + i];
        nodes_[k][i].lon = unwrapped(nodes_[k][i].lon, nodes_[0][0].lon);
      }
  }

  /// For the places of row `r` of the cell.
  std::array<Geographic, 4> line(int r) const {
    const auto& w = weights()[std::size_t(r)];
    std::array<Geographic, 4> line{};
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 4; ++k) {
        line[i].lon += w[k] * nodes_[k][i].lon;
        line[i].lat += w[k] * nodes_[k][i].lat;
      }
    return line;
  }
  static Geographic place(const std::array<Geographic, 4>& n, int c) {
    const auto& w = weights()[std::size_t(c)];
    return {normal(w[0] * n[0].lon + w[1] * n[1].lon + w[2] * n[2].lon + w[3] * n[3].lon),
            w[0] * n[0].lat + w[1] * n[1].lat + w[2] * n[2].lat + w[3] * n[3].lat};
  }

  /// `truth`: the places of its trials. NaN is not good.
  bool good(std::span<const Geographic> truth) const {
    std::size_t k = 0;
    for (const int r : kTrials) {
      const auto n = line(r);
      for (const int c : kTrials) {
        const Geographic at = place(n, c), is = truth[k++];
        if (!(std::abs(unwrapped(at.lon, is.lon) - is.lon) <= kGoodEnough &&
              std::abs(at.lat - is.lat) <= kGoodEnough))
          return false;
      }
    }
    return true;
  }

 private:
  static const std::array<std::array<double, 4>, kCell>& weights() {
    static const auto table = lagrange_weights();
    return table;
  }
  std::array<std::array<Geographic, 4>, 4> nodes_;
};

/// The posts of a window, (col + i * step, row + j * step), that are in one cell.
struct Range {
  int begin, end;
  Range(std::int64_t cell, std::int64_t first, int count, int step) {
    const auto at_least = [&](std::int64_t post) {
      return int(std::clamp<std::int64_t>(-floor_div(first - post, step), 0, count));
    };
    begin = at_least(cell * kCell), end = at_least((cell + 1) * kCell);
  }
};

}  // namespace

std::vector<Geographic> post_positions(const DemSource& source, std::int64_t col, std::int64_t row,
                                       int cols, int rows, int step) {
  const auto post = [&](int i, int j) {
    return Vec2{double(col + std::int64_t(i) * step), double(row + std::int64_t(j) * step)};
  };
  if (source.is_plain_geographic()) {
    std::vector<Vec2> posts;
    posts.reserve(std::size_t(cols) * rows);
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < cols; ++i) posts.push_back(post(i, j));
    return exact(source, posts);
  }
  const std::int64_t cell_col = floor_div(col, kCell), cell_row = floor_div(row, kCell);
  const std::int64_t end_col = floor_div(col + std::int64_t(cols - 1) * step, kCell) + 1;
  const std::int64_t end_row = floor_div(row + std::int64_t(rows - 1) * step, kCell) + 1;
  const std::int64_t node_cols = (end_col - cell_col) * 3 + 1,
                     node_rows = (end_row - cell_row) * 3 + 1;
  std::vector<Vec2> asked;
  for (std::int64_t j = 0; j < node_rows; ++j)
    for (std::int64_t i = 0; i < node_cols; ++i)
      asked.push_back(
          {double(cell_col * kCell + i * kNodeStep), double(cell_row * kCell + j * kNodeStep)});
  const std::vector<Geographic> nodes = exact(source, asked);
  asked.clear();
  for (std::int64_t y = cell_row; y < end_row; ++y)
    for (std::int64_t x = cell_col; x < end_col; ++x)
      for (const int r : kTrials)
        for (const int c : kTrials) asked.push_back({double(x * kCell + c), double(y * kCell + r)});
  const std::vector<Geographic> trials = exact(source, asked);
  asked.clear();

  std::vector<Geographic> out(std::size_t(cols) * rows);
  std::vector<std::size_t> places;  // in `out`, of the posts in `asked`
  const Geographic* trial = trials.data();
  constexpr std::size_t kTrialCount = kTrials.size() * kTrials.size();
  for (std::int64_t y = cell_row; y < end_row; ++y)
    for (std::int64_t x = cell_col; x < end_col; ++x, trial += kTrialCount) {
      const Cell cell(&nodes[std::size_t((y - cell_row) * 3 * node_cols + (x - cell_col) * 3)],
                      node_cols);
      const bool good = cell.good({trial, kTrialCount});
      const Range across(x, col, cols, step), down(y, row, rows, step);
      for (int j = down.begin; j < down.end; ++j) {
        std::array<Geographic, 4> line{};
        if (good) line = cell.line(int(row + std::int64_t(j) * step - y * kCell));
        for (int i = across.begin; i < across.end; ++i) {
          const std::size_t at = std::size_t(j) * cols + i;
          if (good) {
            out[at] = Cell::place(line, int(col + std::int64_t(i) * step - x * kCell));
          } else {
            places.push_back(at);
            asked.push_back(post(i, j));
          }
        }
      }
    }
  if (asked.empty()) return out;
  const std::vector<Geographic> rest = exact(source, asked);
  for (std::size_t k = 0; k < places.size(); ++k) out[places[k]] = rest[k];
  return out;
}

}  // namespace tind
