#pragma once
// How far triangles are, vertically, from a terrain mesh that stays as it is: exactly, over the
// whole area and not only at vertices or posts.
//
// Two piecewise linear surfaces differ most at a vertex of one, or where edges of both cross. Here
// every corner of a triangle stands over a vertex of the mesh, so two kinds of places remain.

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "terrain/mesh/tin.h"

namespace tind {

class MeshDeviation {
 public:
  /// Keeps a copy. The mesh is a terrain: nothing overlaps seen from above.
  explicit MeshDeviation(const Tin& mesh);

  /// max |abc - mesh| over the closed triangle. REQUIRES: counter-clockwise; every corner stands at
  /// the x and y of a vertex of the mesh. Rounding stays below 1e-12 of the heights.
  double of(const Vec3& a, const Vec3& b, const Vec3& c);

  /// Calls f(v) for the mesh's vertices that stand in the closed triangle. REQUIRES:
  /// counter-clockwise.
  template <class F>
  void each_vertex(const Vec3& a, const Vec3& b, const Vec3& c, F&& f) const;

  /// Calls f(v, share) where an edge of the mesh crosses the segment from a to b; v lies on the
  /// mesh, `share` of the way.
  template <class F>
  void each_crossing(const Vec3& a, const Vec3& b, F&& f);

 private:
  struct Edge {
    Vec3 from, to;
  };
  /// Not below 0 on the left of the line from s to t; exact for integers below 2^24.
  struct Line {
    double across, along, offset;
    Line(const Vec3& s, const Vec3& t)
        : across(s.y - t.y), along(t.x - s.x), offset(-(across * s.x + along * s.y)) {}
    double at(const Vec3& p) const { return across * p.x + along * p.y + offset; }
  };

  std::vector<Vec3> vertices_;  // by cell
  std::vector<std::uint32_t> first_vertex_;
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> first_edge_, edge_;  // by cell
  std::vector<std::uint32_t> seen_;               // of each edge: the last question it came in
  std::uint32_t question_ = 0;
  double x0_ = 0, y0_ = 0, per_cell_x_ = 1, per_cell_y_ = 1;
  int cells_ = 1;

  int cell(double at, double origin, double per_cell) const {
    return std::clamp(int((at - origin) / per_cell), 0, cells_ - 1);
  }
  /// The cells that a triangle touches, row by row: f(first, last) of each row; perhaps one more at
  /// an end.
  template <class F>
  void each_row(const std::array<Vec3, 3>& t, F&& f) const;
};

// ---- implementation -------------------------------------------------------------------------

template <class F>
void MeshDeviation::each_row(const std::array<Vec3, 3>& t, F&& f) const {
  const int low = cell(std::min({t[0].y, t[1].y, t[2].y}), y0_, per_cell_y_);
  const int high = cell(std::max({t[0].y, t[1].y, t[2].y}), y0_, per_cell_y_);
  for (int row = low; row <= high; ++row) {
    // What of the triangle lies between the row's two lines, a little wider than they are.
    const double south = y0_ + (row - 1e-6) * per_cell_y_, north = south + 1.000002 * per_cell_y_;
    double west = 1e300, east = -1e300;
    const auto touch = [&](double x) { west = std::min(west, x), east = std::max(east, x); };
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &p = t[k], &q = t[(k + 1) % 3];
      if (p.y >= south && p.y <= north) touch(p.x);
      for (const double y : {south, north})
        if ((p.y < y) != (q.y < y)) touch(p.x + (q.x - p.x) * ((y - p.y) / (q.y - p.y)));
    }
    if (west > east) continue;
    const int left = cell(west - 1e-6 * per_cell_x_, x0_, per_cell_x_);
    const int right = cell(east + 1e-6 * per_cell_x_, x0_, per_cell_x_);
    f(std::size_t(row) * cells_ + left, std::size_t(row) * cells_ + right);
  }
}

template <class F>
void MeshDeviation::each_vertex(const Vec3& a, const Vec3& b, const Vec3& c, F&& f) const {
  const Line ab(a, b), bc(b, c), ca(c, a);
  each_row({a, b, c}, [&](std::size_t first, std::size_t last) {
    for (std::uint32_t k = first_vertex_[first]; k < first_vertex_[last + 1]; ++k) {
      const Vec3& v = vertices_[k];
      if (ab.at(v) >= 0 && bc.at(v) >= 0 && ca.at(v) >= 0) f(v);
    }
  });
}

template <class F>
void MeshDeviation::each_crossing(const Vec3& a, const Vec3& b, F&& f) {
  ++question_;
  const Line line(a, b);
  const double length = line.along * line.along + line.across * line.across;
  each_row({a, b, b}, [&](std::size_t first, std::size_t last) {
    for (std::uint32_t k = first_edge_[first]; k < first_edge_[last + 1]; ++k) {
      const std::uint32_t e = edge_[k];
      const Vec3 &p = edges_[e].from, &q = edges_[e].to;
      const double at_p = line.at(p), at_q = line.at(q);
      if (!(at_p * at_q < 0) || seen_[e] == question_) continue;
      seen_[e] = question_;
      const Vec3 v = p + (q - p) * (at_p / (at_p - at_q));
      const double share = ((v.x - a.x) * line.along - (v.y - a.y) * line.across) / length;
      if (share >= 0 && share <= 1) f(v, share);
    }
  });
}

}  // namespace tind
