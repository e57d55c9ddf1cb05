#pragma once
// Polygons over a grid of posts: which posts and which places lie inside.

#include <cstdint>
#include <vector>

#include "terrain/mesh/tin.h"

namespace tind {

/// A polygon is any set of edges, in any order, that closes; inside is what an odd number of them
/// surrounds. Coordinates are posts (x = col, y = -row); edges may reach beyond the grid.
class PolygonSet {
 public:
  struct Edge {
    Vec2 a, b;
  };
  static constexpr std::uint32_t kNone = ~std::uint32_t(0);

  explicit PolygonSet(int rows = 1) : rows_(std::size_t(rows)) {}

  /// Adds a polygon; returns its number, counted from 0.
  std::uint32_t add(std::vector<Edge> edges);

  std::size_t size() const { return polygons_.size(); }

  /// The first polygon that holds the place, which is not on an edge; kNone where none does.
  /// REQUIRES: 0 <= -y <= rows - 1. O(edges that cross the row).
  std::uint32_t holding(double x, double y) const;

  /// Calls f(row, first col, last col) for the posts inside `polygon`. Posts within 1e-9 of an edge
  /// east or west of them count; posts on horizontal edges and tips may be missed.
  template <class F>
  void fill(std::uint32_t polygon, int cols, F&& f) const {
    std::vector<std::vector<double>> crossings = row_crossings(polygon);
    for (std::size_t r = 0; r < crossings.size(); ++r) {
      for (std::size_t k = 0; k + 1 < crossings[r].size(); k += 2) {
        const int first = int(std::max(0.0, std::ceil(crossings[r][k] - 1e-9)));
        const int last = int(std::min(cols - 1.0, std::floor(crossings[r][k + 1] + 1e-9)));
        if (first <= last) f(int(r), first, last);
      }
    }
  }

 private:
  struct RowEdge {
    std::uint32_t polygon;
    Edge edge;
  };
  std::vector<std::vector<Edge>> polygons_;
  std::vector<std::vector<RowEdge>> rows_;  // edges that touch rows r..r + 1, by polygon

  std::vector<std::vector<double>> row_crossings(std::uint32_t polygon) const;
};

}  // namespace tind
