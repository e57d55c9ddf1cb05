#pragma once
// Lines in a mesh that is being refined: which edges stay, and the points on lines that may become
// vertices. A point is inserted by its position in the order of the line, never by a geometric
// test, so that the line stays straight to the last bit.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/mesh/line_edges.h"

namespace tind {

class LinePoints {
 public:
  using Index = HalfedgeMesh::Index;
  static constexpr Index kNone = HalfedgeMesh::kNone;

  /// An edge that stays and has no points of its own.
  void add_edge(Index a, Index b) { edges_.add(a, b); }
  /// It need not stay any more; its ends are on lines all the same.
  void remove_edge(Index a, Index b) { edges_.remove(a, b); }
  /// Vertex v has halved it.
  void split_edge(Index a, Index b, Index v) {
    edges_.remove(a, b);
    edges_.add(a, v);
    edges_.add(v, b);
  }

  /// The edge a-b of the mesh, with `inner` exactly on it, in order from a to b.
  void add_line(Index a, Index b, std::span<const Vec3> inner);

  /// After the last add: makes the points findable.
  void index_points();

  bool keeps(Index a, Index b) const { return edges_.contains(a, b); }
  bool on_line(Index v) const { return edges_.on_line(v); }

  const Vec3& point(std::size_t k) const { return points_[k].at; }

  /// f(point, its number) for those in the closed triangle abc, 1e-7 larger on each side.
  template <class F>
  void scan(const Vec3& a, const Vec3& b, const Vec3& c, F&& f) const;

  /// Makes point k a vertex; kNone when it is one, or when a triangle would lose its area.
  Index insert(HalfedgeMesh&, std::size_t k);

 private:
  struct Point {
    Vec3 at;
    std::size_t line;
    Index vertex = kNone;
  };
  struct Line {
    Index a, b;
    std::size_t first, last;  // its points
  };
  LineEdges edges_;
  std::vector<Point> points_;
  std::vector<Line> lines_;
  /// Points by strips of height 1, from north to south; within a strip by x.
  std::vector<std::uint32_t> order_;
  std::vector<std::size_t> strip_start_;
  int first_strip_ = 0;

  static int strip_of(double y) { return int(std::floor(-y)); }
};

template <class F>
void LinePoints::scan(const Vec3& a, const Vec3& b, const Vec3& c, F&& f) const {
  if (order_.empty()) return;
  constexpr double kHair = 1e-7;
  const double ab = kHair * std::hypot(b.x - a.x, b.y - a.y);
  const double bc = kHair * std::hypot(c.x - b.x, c.y - b.y);
  const double ca = kHair * std::hypot(a.x - c.x, a.y - c.y);
  const int strips = int(strip_start_.size()) - 1;
  const int first = strip_of(std::max({a.y, b.y, c.y}) + kHair) - first_strip_;
  const int last = strip_of(std::min({a.y, b.y, c.y}) - kHair) - first_strip_;
  for (int s = std::max(0, first); s <= std::min(strips - 1, last); ++s) {
    // The triangle's extent in x within the strip.
    const double top = -double(s + first_strip_) + kHair, bottom = top - 1 - 2 * kHair;
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const auto& [p, q] : {std::pair{&a, &b}, {&b, &c}, {&c, &a}}) {
      if (std::min(p->y, q->y) > top || std::max(p->y, q->y) < bottom) continue;
      const double dy = q->y - p->y;
      for (const double edge : {top, bottom}) {
        const double t = dy == 0 ? 0 : std::clamp((edge - p->y) / dy, 0.0, 1.0);
        const double x = p->x + t * (q->x - p->x);
        low = std::min(low, x), high = std::max(high, x);
      }
      if (dy == 0) low = std::min(low, q->x), high = std::max(high, q->x);
    }
    const auto begin = order_.begin() + std::ptrdiff_t(strip_start_[std::size_t(s)]);
    const auto end = order_.begin() + std::ptrdiff_t(strip_start_[std::size_t(s) + 1]);
    auto k = std::lower_bound(begin, end, low - kHair,
                              [&](std::uint32_t i, double x) { return points_[i].at.x < x; });
    for (; k != end && points_[*k].at.x <= high + kHair; ++k) {
      const Vec3& p = points_[*k].at;
      if (orient2d(a, b, p) < -ab || orient2d(b, c, p) < -bc || orient2d(c, a, p) < -ca) continue;
      f(p, std::size_t(*k));
    }
  }
}

}  // namespace tind
