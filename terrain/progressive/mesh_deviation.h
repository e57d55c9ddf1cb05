#pragma once
// How far triangles are, vertically, from a terrain mesh that stays as it is: exactly, over the
// whole area and not only at vertices or posts.

#include <algorithm>
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

  /// Calls f(p), p on the mesh, for the ends of what each of its edges has inside abc. Between
  /// these points the triangle and the mesh differ linearly, so one of them is where they differ
  /// most. Points come more than once. REQUIRES: as above.
  template <class F>
  void each_extreme(const Vec3& a, const Vec3& b, const Vec3& c, F&& f);

 private:
  struct Edge {
    Vec3 from, to;
  };
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> seen_;  // of each edge: the last question in which it came
  std::uint32_t question_ = 0;
  // Edges by the cells of a grid that their boxes touch.
  double x0_ = 0, y0_ = 0, per_cell_x_ = 1, per_cell_y_ = 1;
  int cells_ = 1;
  std::vector<std::uint32_t> first_, in_cell_;

  int cell(double at, double origin, double per_cell) const {
    return std::clamp(int((at - origin) / per_cell), 0, cells_ - 1);
  }
  template <class F>
  void each_cell(double x_min, double x_max, double y_min, double y_max, F&& f) const {
    const int left = cell(x_min, x0_, per_cell_x_), right = cell(x_max, x0_, per_cell_x_);
    const int low = cell(y_min, y0_, per_cell_y_), high = cell(y_max, y0_, per_cell_y_);
    for (int row = low; row <= high; ++row)
      for (int col = left; col <= right; ++col) f(std::size_t(row * cells_ + col));
  }
};

// ---- implementation -------------------------------------------------------------------------

template <class F>
void MeshDeviation::each_extreme(const Vec3& a, const Vec3& b, const Vec3& c, F&& f) {
  ++question_;
  const auto [x_min, x_max] = std::minmax({a.x, b.x, c.x});
  const auto [y_min, y_max] = std::minmax({a.y, b.y, c.y});
  each_cell(x_min, x_max, y_min, y_max, [&](std::size_t in) {
    for (std::uint32_t k = first_[in]; k < first_[in + 1]; ++k) {
      const std::uint32_t e = in_cell_[k];
      if (seen_[e] == question_) continue;
      seen_[e] = question_;
      const Vec3 &p = edges_[e].from, &q = edges_[e].to;
      // The part of p q on the left of all three sides (Cyrus and Beck).
      double enters = 0, leaves = 1;
      for (const auto& [s, t] : {std::pair{&a, &b}, {&b, &c}, {&c, &a}}) {
        const double at_p = orient2d(*s, *t, p), at_q = orient2d(*s, *t, q);
        if (at_p < 0 && at_q < 0) {
          enters = 2;
          break;
        }
        if (at_p < 0) enters = std::max(enters, at_p / (at_p - at_q));
        if (at_q < 0) leaves = std::min(leaves, at_p / (at_p - at_q));
      }
      if (enters > leaves) continue;
      f(enters > 0 ? p + (q - p) * enters : p);
      f(leaves < 1 ? p + (q - p) * leaves : q);
    }
  });
}

}  // namespace tind
