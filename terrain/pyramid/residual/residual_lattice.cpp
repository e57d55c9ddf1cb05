#include "terrain/pyramid/residual/residual_lattice.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "terrain/mesh/triangle_plane.h"

namespace tind {

namespace {

constexpr double kExtent = ResidualLattice::kExtent;
constexpr double kHair = 1e-6;  // of a cell: so near a line a place belongs to both sides

/// Collects |mesh - surface|: at nodes, and by cell at what lies between them.
class Overlay {
 public:
  explicit Overlay(const ResidualLattice& lattice)
      : lattice_(lattice),
        cells_(lattice.cells),
        side_(kExtent / lattice.cells),
        at_node_(lattice.heights.size()),
        worst_(lattice.residual.size()) {}

  /// A node, which is of the surface.
  void node(std::size_t i, double gap) { at_node_[i] = std::max(at_node_[i], gap); }

  /// Any other vertex of the overlay; it counts in every cell that it touches, against the surface
  /// of that cell: a hair beside it that of its neighbour can be another by more than rounding.
  void at(double x, double y, double z) {
    const double i = x / side_, j = (kExtent - y) / side_;
    const int i0 = cell(i - kHair), i1 = cell(i + kHair);
    const int j0 = cell(j - kHair), j1 = cell(j + kHair);
    for (int row = j0; row <= j1; ++row)
      for (int col = i0; col <= i1; ++col) {
        const std::size_t c = std::size_t(row) * std::size_t(cells_) + std::size_t(col);
        if (lattice_.residual[c] < 0) continue;
        const double gap = std::abs(z - surface(col, row).at(x, y));
        worst_[c] = std::max(worst_[c], gap);
      }
  }

  /// Where a mesh edge crosses the lines of the lattice: columns, rows, cuts.
  void edge(const Vec3& a, const Vec3& b) {
    cross(a, b, a.x / side_, b.x / side_);
    cross(a, b, a.y / side_, b.y / side_);
    cross(a, b, (a.x - a.y) / side_, (b.x - b.y) / side_);
  }

  /// Calls f(cell, bound) for every cell that holds posts.
  template <class F>
  void each(F&& f) const {
    const auto nodes = std::size_t(lattice_.nodes());
    for (std::size_t row = 0, c = 0; row < std::size_t(cells_); ++row)
      for (std::size_t col = 0; col < std::size_t(cells_); ++col, ++c) {
        if (lattice_.residual[c] < 0) continue;
        const double* const north = &at_node_[row * nodes + col];
        const double* const south = north + nodes;
        f(c, std::max({worst_[c], north[0], north[1], south[0], south[1]}) + lattice_.residual[c]);
      }
  }

 private:
  const ResidualLattice& lattice_;
  const int cells_;
  const double side_;
  std::vector<double> at_node_, worst_;

  int cell(double t) const { return std::clamp(int(std::floor(t)), 0, cells_ - 1); }

  LatticeCell surface(int col, int row) const {
    const float* north =
        &lattice_.heights[std::size_t(row) * std::size_t(lattice_.nodes()) + std::size_t(col)];
    const float* south = north + lattice_.nodes();
    return {south[0], south[1], north[0], north[1], col * side_, kExtent - (row + 1) * side_,
            side_};
  }

  /// `from` and `to`: where a and b lie, in lines of one family.
  void cross(const Vec3& a, const Vec3& b, double from, double to) {
    if (from == to) return;
    const int first = int(std::ceil(std::min(from, to))),
              last = int(std::floor(std::max(from, to)));
    for (int k = first; k <= last; ++k) {
      const double t = std::clamp((k - from) / (to - from), 0.0, 1.0);
      at(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z));
    }
  }
};

Overlay overlay_of(const Tin& mesh, const ResidualLattice& lattice) {
  Overlay overlay(lattice);
  const GridSamples nodes = ResidualLattice::samples(lattice.heights, lattice.nodes());
  for (const Vec3& v : mesh.vertices) overlay.at(v.x, v.y, v.z);
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const TrianglePlane plane(a, b, c);
    nodes.scan(a, b, c, [&](double x, double y, double z, std::size_t i) {
      overlay.node(i, std::abs(plane.at(x, y) - z));
      return true;
    });
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t i = t[std::size_t(k)], j = t[std::size_t((k + 1) % 3)];
      // Once for the two triangles of an edge; a side of the rectangle has one that runs forward.
      const bool side =
          mesh.vertices[i].x == mesh.vertices[j].x || mesh.vertices[i].y == mesh.vertices[j].y;
      if (i < j || side) overlay.edge(mesh.vertices[i], mesh.vertices[j]);
    }
  }
  return overlay;
}

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
  return std::max(0.0, double(*std::ranges::max_element(residual)));
}

double ResidualLattice::nearest(double x, double y) const {
  const auto col = std::size_t(std::lround(x / kExtent * cells)),
             row = std::size_t(std::lround((kExtent - y) / kExtent * cells));
  return heights[row * std::size_t(nodes()) + col];
}

double lattice_bound(const Tin& mesh, const ResidualLattice& lattice) {
  double bound = 0;
  overlay_of(mesh, lattice).each([&](std::size_t, double b) { bound = std::max(bound, b); });
  return bound;
}

std::vector<float> heights_of_cells_over(const Tin& mesh, const ResidualLattice& lattice,
                                         double limit) {
  std::vector<float> heights(lattice.heights.size(), std::numeric_limits<float>::quiet_NaN());
  const auto cells = std::size_t(lattice.cells), nodes = cells + 1;
  overlay_of(mesh, lattice).each([&](std::size_t c, double bound) {
    if (bound <= limit) return;
    const std::size_t north_west = c / cells * nodes + c % cells;
    for (const std::size_t i :
         {north_west, north_west + 1, north_west + nodes, north_west + nodes + 1})
      heights[i] = lattice.heights[i];
  });
  return heights;
}

}  // namespace tind
