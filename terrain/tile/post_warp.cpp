// Tensor-product cubic Lagrange interpolation of the projection, in cells of 48 x 48 posts that are
// fixed to the source (not to the window), so that a post has one position.

#include "terrain/tile/post_warp.h"

#include <array>
#include <cmath>

namespace tind {

namespace {

constexpr int kNodeStep = 16, kCell = 3 * kNodeStep;

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

std::vector<Geographic> exact(const DemSource& source, std::int64_t col, std::int64_t row, int cols,
                              int rows, int step) {
  std::vector<Vec2> posts(std::size_t(cols) * rows);
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < cols; ++i)
      posts[std::size_t(j) * cols + i] = {double(col + std::int64_t(i) * step),
                                          double(row + std::int64_t(j) * step)};
  std::vector<Geographic> out(posts.size());
  source.to_geographic(posts, out);
  return out;
}

}  // namespace

std::vector<Geographic> post_positions(const DemSource& source, std::int64_t col, std::int64_t row,
                                       int cols, int rows, int step) {
  if (source.is_plain_geographic()) return exact(source, col, row, cols, rows, step);
  static const auto weights = lagrange_weights();
  const std::int64_t cell_col = floor_div(col, kCell), cell_row = floor_div(row, kCell);
  const std::int64_t end_col = floor_div(col + std::int64_t(cols - 1) * step, kCell) + 1;
  const std::int64_t end_row = floor_div(row + std::int64_t(rows - 1) * step, kCell) + 1;
  const int node_cols = int(end_col - cell_col) * 3 + 1,
            node_rows = int(end_row - cell_row) * 3 + 1;
  std::vector<Geographic> nodes =
      exact(source, cell_col * kCell, cell_row * kCell, node_cols, node_rows, kNodeStep);

  std::vector<Geographic> out(std::size_t(cols) * rows), line(node_cols);
  for (int j = 0; j < rows; ++j) {
    const std::int64_t r = row + std::int64_t(j) * step - cell_row * kCell;
    const auto& wy = weights[std::size_t(r % kCell)];
    const Geographic* first = &nodes[std::size_t(r / kCell) * 3 * node_cols];
    for (int i = 0; i < node_cols; ++i) {
      line[i] = {};
      for (int k = 0; k < 4; ++k) {
        line[i].lon += wy[k] * first[k * node_cols + i].lon;
        line[i].lat += wy[k] * first[k * node_cols + i].lat;
      }
    }
    for (int i = 0; i < cols; ++i) {
      const std::int64_t c = col + std::int64_t(i) * step - cell_col * kCell;
      const auto& wx = weights[std::size_t(c % kCell)];
      const Geographic* n = &line[std::size_t(c / kCell) * 3];
      out[std::size_t(j) * cols + i] = {
          wx[0] * n[0].lon + wx[1] * n[1].lon + wx[2] * n[2].lon + wx[3] * n[3].lon,
          wx[0] * n[0].lat + wx[1] * n[1].lat + wx[2] * n[2].lat + wx[3] * n[3].lat};
    }
  }
  return out;
}

}  // namespace tind
