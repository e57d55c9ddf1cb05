// Voids are filled by a pyramid of means: from coarse to fine each void takes what the level above
// says, and some rounds of averaging take out its steps.

#include "terrain/simplify/constraints/voids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "terrain/mesh/manifold.h"

namespace tind {
namespace {

constexpr int kRounds = 8;  // of averaging, at each level

/// The cell whose north-western corner is (col, row).
class Cell {
 public:
  Cell(const HeightGrid& grid, int col, int row) : there_(grid.inside(col, row)) {
    there_ = there_ && grid.inside(col + 1, row + 1);
    if (!there_) return;
    nw = !grid.is_void(col, row), ne = !grid.is_void(col + 1, row);
    sw = !grid.is_void(col, row + 1), se = !grid.is_void(col + 1, row + 1);
  }
  bool nw = false, ne = false, sw = false, se = false;

  bool beyond() const { return !there_; }  // the DEM
  int valid() const { return int(nw) + int(ne) + int(sw) + int(se); }
  /// Has it triangles at its sides (whose both ends are valid)?
  bool ends_at_sides() const { return valid() >= 3; }
  /// Is a place in one of its triangles? x to the east, y to the south, 0..1.
  bool holds(double x, double y) const {
    if (valid() < 3) return false;
    return valid() == 4 || (!nw && x + y > 1) || (!se && x + y < 1) || (!ne && y > x) ||
           (!sw && y < x);
  }

 private:
  bool there_;
};

/// Runs of sides one after the other become one line.
class Lines {
 public:
  void add(bool is_rim, int col, int row, int dcol, int drow) {
    if (!is_rim) return end();
    if (open_ && to_ == std::pair(col, row))
      to_ = {col + dcol, row + drow};
    else
      end(), open_ = true, from_ = {col, row}, to_ = {col + dcol, row + drow};
  }
  void end() {
    if (open_) lines_.push_back({point(from_), point(to_)});
    open_ = false;
  }
  std::vector<VectorLine> take() {
    end();
    return std::move(lines_);
  }

 private:
  using Post = std::pair<int, int>;
  static Vec3 point(Post p) {
    return {double(p.first), -double(p.second), std::numeric_limits<double>::quiet_NaN()};
  }
  bool open_ = false;
  Post from_, to_;
  std::vector<VectorLine> lines_;
};

/// Is the side between two cells a rim? At the DEM's own sides there is none.
bool parts(const Cell& a, const Cell& b, bool both_ends_valid) {
  return both_ends_valid && !a.beyond() && !b.beyond() && a.ends_at_sides() != b.ends_at_sides();
}

HeightGrid halved(const HeightGrid& fine) {
  HeightGrid coarse((fine.cols() + 1) / 2, (fine.rows() + 1) / 2);
  for (int r = 0; r < coarse.rows(); ++r)
    for (int c = 0; c < coarse.cols(); ++c) {
      double sum = 0;
      int count = 0;
      for (int k = 0; k < 4; ++k) {
        const int col = 2 * c + k % 2, row = 2 * r + k / 2;
        if (fine.inside(col, row) && !fine.is_void(col, row)) sum += fine.at(col, row), ++count;
      }
      if (count > 0) coarse.at(c, r) = float(sum / count);
    }
  return coarse;
}

/// Of a grid without voids whose values stand in the middles of 2 x 2 posts.
float between(const HeightGrid& coarse, int col, int row) {
  const auto place = [](int at, int count) {
    const double x = std::clamp((at - 0.5) / 2, 0.0, count - 1.0);
    const int low = std::min(int(x), std::max(0, count - 2));
    return std::pair(low, x - low);
  };
  const auto [c, s] = place(col, coarse.cols());
  const auto [r, t] = place(row, coarse.rows());
  const int east = std::min(c + 1, coarse.cols() - 1), south = std::min(r + 1, coarse.rows() - 1);
  return float((1 - t) * ((1 - s) * coarse.at(c, r) + s * coarse.at(east, r)) +
               t * ((1 - s) * coarse.at(c, south) + s * coarse.at(east, south)));
}

void fill_from(HeightGrid& fine, const HeightGrid& coarse) {
  std::vector<std::pair<int, int>> voids;
  for (int r = 0; r < fine.rows(); ++r)
    for (int c = 0; c < fine.cols(); ++c)
      if (fine.is_void(c, r)) voids.emplace_back(c, r);
  for (const auto& [c, r] : voids) fine.at(c, r) = between(coarse, c, r);
  constexpr std::array<std::pair<int, int>, 4> kBeside = {{{0, -1}, {-1, 0}, {1, 0}, {0, 1}}};
  for (int round = 0; round < kRounds; ++round)
    for (const auto& [c, r] : voids) {
      double sum = 0;
      int count = 0;
      for (const auto& [dc, dr] : kBeside)
        if (fine.inside(c + dc, r + dr)) sum += fine.at(c + dc, r + dr), ++count;
      if (count > 0) fine.at(c, r) = float(sum / count);
    }
}

}  // namespace

bool has_voids(const HeightGrid& grid) {
  return std::ranges::any_of(grid.values(), [](float h) { return std::isnan(h); });
}

Error no_triangle(const HeightGrid& grid) {
  const auto valid = std::ranges::count_if(grid.values(), [](float z) { return !std::isnan(z); });
  if (valid == 0) return {Errc::bad_data, "the heights are all void: there is nothing to simplify"};
  return {Errc::bad_data,
          "no cell has three valid corners, so the valid posts (" + std::to_string(valid) +
              ") are in no triangle; 'tind simplify --voids cover' spans the voids between them"};
}

std::vector<VectorLine> void_rims(const HeightGrid& grid) {
  Lines lines;
  for (int r = 0; r < grid.rows(); ++r, lines.end())
    for (int c = 0; c + 1 < grid.cols(); ++c)
      lines.add(parts(Cell(grid, c, r - 1), Cell(grid, c, r),
                      !grid.is_void(c, r) && !grid.is_void(c + 1, r)),
                c, r, 1, 0);
  for (int c = 0; c < grid.cols(); ++c, lines.end())
    for (int r = 0; r + 1 < grid.rows(); ++r)
      lines.add(parts(Cell(grid, c - 1, r), Cell(grid, c, r),
                      !grid.is_void(c, r) && !grid.is_void(c, r + 1)),
                c, r, 0, 1);
  for (int r = 0; r + 1 < grid.rows(); ++r)
    for (int c = 0; c + 1 < grid.cols(); ++c) {
      const Cell cell(grid, c, r);
      if (cell.valid() != 3) continue;
      lines.end();  // the one before may run another way
      if (cell.nw && cell.se)
        lines.add(true, c, r, 1, 1);
      else
        lines.add(true, c, r + 1, 1, -1);
    }
  return lines.take();
}

void open_voids(Tin& tin, const HeightGrid& grid) {
  std::erase_if(tin.triangles, [&](const Triangle& t) {
    const Vec3 middle = (tin.vertices[t[0]] + tin.vertices[t[1]] + tin.vertices[t[2]]) * (1 / 3.0);
    const int col = std::clamp(int(middle.x), 0, grid.cols() - 2),
              row = std::clamp(int(-middle.y), 0, grid.rows() - 2);
    return !Cell(grid, col, row).holds(middle.x - col, -middle.y - row);
  });
  split_fans(tin, CopyOrder::of_vertices);
  drop_unused_vertices(tin);
}

HeightGrid covered(HeightGrid grid) {
  std::vector<HeightGrid> levels;
  levels.push_back(std::move(grid));
  while (has_voids(levels.back()) && levels.back().size() > 1)
    levels.push_back(halved(levels.back()));
  for (std::size_t k = levels.size() - 1; k > 0; --k)
    if (!has_voids(levels[k])) fill_from(levels[k - 1], levels[k]);
  return std::move(levels.front());
}

}  // namespace tind
