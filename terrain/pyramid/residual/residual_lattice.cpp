#include "terrain/pyramid/residual/residual_lattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "terrain/mesh/triangle_plane.h"

namespace tind {

namespace {

constexpr double kExtent = ResidualLattice::kExtent;
constexpr double kHair = 1e-6;      // of a cell: so near a line a place belongs to both sides
constexpr double kRounding = 1e-9;  // of a band: what is left out is inside for certain
constexpr std::size_t kLanes = 16;  // side by side, for the compiler

/// The largest of f(value), at least 0.
template <class F>
float largest(const std::vector<float>& values, F&& f) {
  std::array<float, kLanes> most{};
  std::size_t i = 0;
  for (; i + kLanes <= values.size(); i += kLanes)
    for (std::size_t k = 0; k < kLanes; ++k)
      most[k] = f(values[i + k]) > most[k] ? f(values[i + k]) : most[k];
  for (; i < values.size(); ++i) most[0] = std::max(most[0], f(values[i]));
  return *std::ranges::max_element(most);
}

/// No two heights are farther apart.
double span_of(const std::vector<float>& heights) {
  return 2 * double(largest(heights, [](float h) { return h < 0 ? -h : h; }));
}

/// What counts is |mesh - surface| at the vertices of both triangulations' overlay, with the
/// residual of each cell that has a part in it. f(cell, bound) hears of those above a limit, which
/// it may raise; it returns false to end it.
template <class F>
class Overlay {
 public:
  Overlay(const Tin& mesh, const ResidualLattice& lattice, const double& limit, F& f)
      : mesh_(mesh),
        lattice_(lattice),
        cells_(lattice.cells),
        row_length_(std::size_t(lattice.nodes())),
        side_(kExtent / lattice.cells),
        per_side_(lattice.cells / kExtent),
        residual_(lattice.largest_residual()),
        nearly_(2 * kHair * span_of(lattice.heights)),
        limit_(limit),
        f_(f) {}

  void run() {
    for (const Vec3& v : mesh_.vertices)
      if (!at(v.x, v.y, v.z)) return;
    for (const Triangle& t : mesh_.triangles)
      if (!edges(t) || !nodes(t)) return;
  }

 private:
  const Tin& mesh_;
  const ResidualLattice& lattice_;
  const int cells_;
  const std::size_t row_length_;
  const double side_, per_side_;
  const double residual_;  // no cell has a larger one
  const double nearly_;    // what a surface does within a hair, and rounding
  const double& limit_;
  F& f_;

  bool meet(std::size_t c, double gap) {
    const double residual = lattice_.residual[c];
    return !(residual >= 0 && gap + residual > limit_) || f_(c, gap + residual);
  }

  int cell(double t) const { return std::clamp(int(t), 0, cells_ - 1); }

  LatticeCell surface(int col, int row) const {
    const float* north = &lattice_.heights[std::size_t(row) * row_length_ + std::size_t(col)];
    const float* south = north + row_length_;
    return {south[0], south[1], north[0], north[1], col * side_, kExtent - (row + 1) * side_,
            side_};
  }

  /// A vertex of the mesh, or of an edge: it counts in every cell that it touches, against the
  /// surface of that cell: a hair beside it that of its neighbour can be another by more than
  /// rounding.
  bool at(double x, double y, double z) {
    const double i = x / side_, j = (kExtent - y) / side_;
    const int i0 = cell(i - kHair), i1 = cell(i + kHair);
    const int j0 = cell(j - kHair), j1 = cell(j + kHair);
    for (int row = j0; row <= j1; ++row)
      for (int col = i0; col <= i1; ++col)
        if (!meet(std::size_t(row) * std::size_t(cells_) + std::size_t(col),
                  std::abs(z - surface(col, row).at(x, y))))
          return false;
    return true;
  }

  /// A node, which is of the surface: it counts in the cells around it.
  bool node(std::size_t i, double gap) {
    const int row = int(i / row_length_), col = int(i % row_length_);
    for (int j = std::max(0, row - 1); j <= std::min(cells_ - 1, row); ++j)
      for (int k = std::max(0, col - 1); k <= std::min(cells_ - 1, col); ++k)
        if (!meet(std::size_t(j) * std::size_t(cells_) + std::size_t(k), gap)) return false;
    return true;
  }

  /// Those so near the mesh that no residual takes them over the limit are passed over.
  bool nodes(const Triangle& t) {
    const Vec3 &a = mesh_.vertices[t[0]], &b = mesh_.vertices[t[1]], &c = mesh_.vertices[t[2]];
    const TrianglePlane plane(a, b, c);
    const auto [gx, gy] = plane.slope;
    const double rise = std::max(std::abs(b.z - a.z), std::abs(c.z - a.z));
    Band band{a.x, a.y, a.z, 0, gx, gy, 0, gx, gy, 0};
    const auto set_band = [&] {
      const double half = limit_ - residual_;
      band.size = rise + std::abs(half);
      band.top = half - kRounding * (band.size + std::abs(a.z));
      band.bottom = -band.top;
    };
    set_band();
    const GridSamples samples = ResidualLattice::samples(lattice_.heights, lattice_.nodes());
    return samples.scan_outside(a, b, c, band, [&](double x, double y, double z, std::size_t i) {
      if (!node(i, std::abs(plane.at(x, y) - z))) return false;
      set_band();
      return true;
    });
  }

  bool edges(const Triangle& t) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t i = t[std::size_t(k)], j = t[std::size_t((k + 1) % 3)];
      const Vec3 &a = mesh_.vertices[i], &b = mesh_.vertices[j];
      // Once for the two triangles of an edge; a side of the rectangle has one that runs forward.
      const bool side = a.x == b.x || a.y == b.y;
      if ((i < j || side) && !edge(a, b)) return false;
    }
    return true;
  }

  /// Where a mesh edge crosses the lines of the lattice: columns, rows, cuts.
  bool edge(const Vec3& a, const Vec3& b) {
    const std::ptrdiff_t south = std::ptrdiff_t(row_length_);
    return cross(a, b, a.x / side_, b.x / side_, south) &&
           cross(a, b, a.y / side_, b.y / side_, 1) &&
           cross(a, b, (a.x - a.y) / side_, (b.x - b.y) / side_, 1 - south);
  }

  /// `from` and `to`: where a and b lie, in lines of one family. `along`: from a node to the next
  /// on such a line, southward or eastward.
  bool cross(const Vec3& a, const Vec3& b, double from, double to, std::ptrdiff_t along) {
    if (from == to) return true;
    const int first = int(std::ceil(std::min(from, to))),
              last = int(std::floor(std::max(from, to)));
    for (int k = first; k <= last; ++k) {
      const double t = std::clamp((k - from) / (to - from), 0.0, 1.0);
      const Vec3 p{a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)};
      if (!is_near(p, k, along) && !at(p.x, p.y, p.z)) return false;
    }
    return true;
  }

  /// Certainly within the limit, by the two nodes of line k between which it lies.
  bool is_near(const Vec3& p, int k, std::ptrdiff_t along) const {
    const double i = p.x * per_side_, j = (kExtent - p.y) * per_side_;
    const bool column = along == std::ptrdiff_t(row_length_), row = along == 1;
    const double way = column ? j : i;
    const int from = cell(way);
    int col = from, line = from;
    if (column)
      col = std::clamp(k, 0, cells_);
    else if (row)
      line = std::clamp(cells_ - k, 0, cells_);
    else  // the cut of cells with as much to their west, less k, as to their south
      line = cells_ - (from - k);
    if (line < 0 || line > cells_) return false;
    const std::size_t n = std::size_t(line) * row_length_ + std::size_t(col);
    const std::size_t next = std::size_t(std::ptrdiff_t(n) + along);
    if (next >= lattice_.heights.size()) return false;
    const double h = lattice_.heights[n];
    const double gap = std::abs(p.z - (h + (way - from) * (lattice_.heights[next] - h)));
    return gap + residual_ < limit_ - nearly_;
  }
};

}  // namespace

std::vector<float> ResidualLattice::fitted_heights(int step) const {
  const int side = cells / step + 1;
  std::vector<float> fitted(std::size_t(side) * std::size_t(side),
                            std::numeric_limits<float>::quiet_NaN());
  const auto holds_posts = [&](int col, int row) {
    for (int j = row * step; j < (row + 1) * step; ++j) {
      const float* const first =
          &residual[std::size_t(j) * std::size_t(cells) + std::size_t(col) * std::size_t(step)];
      if (std::any_of(first, first + step, [](float r) { return r >= 0; })) return true;
    }
    return false;
  };
  for (int row = 0; row + 1 < side; ++row)
    for (int col = 0; col + 1 < side; ++col) {
      if (!holds_posts(col, row)) continue;
      for (const int j : {row, row + 1})
        for (const int i : {col, col + 1})
          fitted[std::size_t(j) * std::size_t(side) + std::size_t(i)] =
              heights[std::size_t(j * step) * std::size_t(nodes()) + std::size_t(i * step)];
    }
  return fitted;
}

GridSamples ResidualLattice::samples(const std::vector<float>& heights, int nodes) {
  GridSamples grid;
  grid.cols = grid.rows = nodes;
  grid.y0 = kExtent;
  grid.dx = grid.dy = kExtent / (nodes - 1);
  grid.z = heights.data();
  return grid;
}

bool ResidualLattice::any() const {
  return std::ranges::any_of(residual, [](float r) { return r >= 0; });
}

double ResidualLattice::largest_residual() const {
  return double(largest(residual, [](float r) { return r; }));
}

double ResidualLattice::nearest(double x, double y) const {
  const auto col = std::size_t(std::lround(x / kExtent * cells)),
             row = std::size_t(std::lround((kExtent - y) / kExtent * cells));
  return heights[row * std::size_t(nodes()) + col];
}

double lattice_bound(const Tin& mesh, const ResidualLattice& lattice) {
  double bound = 0;
  const auto f = [&](std::size_t, double b) {
    bound = b;
    return true;
  };
  Overlay(mesh, lattice, bound, f).run();
  return bound;
}

bool is_within(const Tin& mesh, const ResidualLattice& lattice, double limit) {
  bool within = true;
  const auto f = [&](std::size_t, double) { return within = false; };
  Overlay(mesh, lattice, limit, f).run();
  return within;
}

std::vector<float> heights_of_cells_over(const Tin& mesh, const ResidualLattice& lattice,
                                         double limit) {
  std::vector<float> heights(lattice.heights.size(), std::numeric_limits<float>::quiet_NaN());
  const auto cells = std::size_t(lattice.cells), nodes = cells + 1;
  const auto f = [&](std::size_t c, double) {
    const std::size_t north_west = c / cells * nodes + c % cells;
    for (const std::size_t i :
         {north_west, north_west + 1, north_west + nodes, north_west + nodes + 1})
      heights[i] = lattice.heights[i];
    return true;
  };
  Overlay(mesh, lattice, limit, f).run();
  return heights;
}

}  // namespace tind
