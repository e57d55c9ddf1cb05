// The full grid mesh. Without voids it is laid out directly; with voids the triangles are gathered
// first and each post's fans are told apart before the half-edges are linked.

#include "terrain/mesh/grid_mesh.h"

#include <algorithm>
#include <array>

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;

Vec3 post(const HeightGrid& grid, int col, int row) {
  return {double(col), double(-row), double(grid.at(col, row))};
}

bool has_void(const HeightGrid& grid) {
  return std::any_of(grid.values().begin(), grid.values().end(),
                     [](float z) { return std::isnan(z); });
}

/// Calls f(a, b, c) with the post indices of every triangle that has three valid corners.
template <class F>
void for_each_triangle(const HeightGrid& grid, F&& f) {
  const std::size_t cols = grid.cols();
  for (int r = 0; r + 1 < grid.rows(); ++r) {
    for (int c = 0; c + 1 < grid.cols(); ++c) {
      const bool ne = !grid.is_void(c + 1, r), sw = !grid.is_void(c, r + 1);
      if (!ne || !sw) continue;
      const std::size_t nw = r * cols + c, south = nw + cols;
      if (!grid.is_void(c, r)) f(nw, south, nw + 1);
      if (!grid.is_void(c + 1, r + 1)) f(south + 1, nw + 1, south);
    }
  }
}

/// The six triangles around a post in counter-clockwise order; bit k of the answer says that the
/// k-th is there. Neighbours run counter-clockwise from the east: E, NE, N, W, SW, S.
unsigned triangles_around(const HeightGrid& grid, int col, int row) {
  constexpr std::array<std::array<int, 2>, 6> kRing = {
      {{1, 0}, {1, -1}, {0, -1}, {-1, 0}, {-1, 1}, {0, 1}}};
  unsigned valid = 0;
  for (unsigned k = 0; k < 6; ++k) {
    const int c = col + kRing[k][0], r = row + kRing[k][1];
    if (grid.inside(c, r) && !grid.is_void(c, r)) valid |= 1u << k;
  }
  return valid & (valid >> 1 | valid << 5) & 63u;
}

/// Which run of neighbouring triangles (fan) triangle `k` of the mask belongs to: 0, 1 or 2.
int fan_of(unsigned mask, unsigned k) {
  if (mask == 63u) return 0;
  unsigned first = k;
  while (mask >> ((first + 5) % 6) & 1u) first = (first + 5) % 6;
  int fan = 0;
  for (unsigned j = 0; j < first; ++j) fan += (mask >> j & 1u) && !(mask >> ((j + 5) % 6) & 1u);
  return fan;
}

Tin tin_with_voids(const HeightGrid& grid) {
  const int cols = grid.cols();
  constexpr Index kNone = HalfedgeMesh::kNone;
  std::vector<std::array<Index, 3>> vertex(grid.size(), {kNone, kNone, kNone});
  Tin tin;
  // Corner k of the two triangles of a cell is this place in the ring of its post.
  constexpr unsigned kUpper[3] = {5, 1, 3}, kLower[3] = {2, 4, 0};
  for_each_triangle(grid, [&](std::size_t a, std::size_t b, std::size_t c) {
    const unsigned* place = a < b ? kUpper : kLower;
    const std::size_t posts[3] = {a, b, c};
    Triangle t;
    for (int k = 0; k < 3; ++k) {
      const int col = int(posts[k] % cols), row = int(posts[k] / cols);
      const unsigned mask = triangles_around(grid, col, row);
      Index& v = vertex[posts[k]][fan_of(mask, place[k])];
      if (v == kNone) {
        v = Index(tin.vertices.size());
        tin.vertices.push_back(post(grid, col, row));
      }
      t[k] = v;
    }
    tin.triangles.push_back(t);
  });
  return tin;
}

}  // namespace

Result<HalfedgeMesh> grid_mesh(const HeightGrid& grid) {
  if (grid.cols() < 2 || grid.rows() < 2) {
    return fail(Errc::invalid_argument, "a mesh needs at least 2 x 2 posts, this DEM has " +
                                            std::to_string(grid.cols()) + " x " +
                                            std::to_string(grid.rows()));
  }
  if (has_void(grid)) {
    const Tin tin = tin_with_voids(grid);
    if (tin.triangles.empty())
      return fail(Errc::bad_data, "no cell of this DEM has three valid posts: nothing to mesh");
    return HalfedgeMesh::from_tin(tin);
  }
  std::vector<Vec3> positions;
  positions.reserve(grid.size());
  for (int r = 0; r < grid.rows(); ++r)
    for (int c = 0; c < grid.cols(); ++c) positions.push_back(post(grid, c, r));
  return HalfedgeMesh::from_grid(grid.cols(), grid.rows(), std::move(positions));
}

std::size_t grid_triangle_count(const HeightGrid& grid) {
  std::size_t count = 0;
  for_each_triangle(grid, [&](std::size_t, std::size_t, std::size_t) { ++count; });
  return count;
}

}  // namespace tind
