#include "terrain/progressive/stream/mesh_deviation.h"

#include <cmath>

namespace tind {

namespace {

constexpr int kMostCells = 96;  // a side

/// Counts to where each cell begins; one more at the end.
void sum_up(std::vector<std::uint32_t>& counts) {
  for (std::size_t i = 1; i < counts.size(); ++i) counts[i] += counts[i - 1];
}

}  // namespace

MeshDeviation::MeshDeviation(const Tin& mesh) {
  for (const Triangle& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      // Both sides of an inner edge come by; a border edge may come as either.
      edges_.push_back({mesh.vertices[std::min(a, b)], mesh.vertices[std::max(a, b)]});
    }
  }
  const auto key = [](const Edge& e) { return std::array{e.from.x, e.from.y, e.to.x, e.to.y}; };
  std::ranges::sort(edges_, {}, key);
  const auto twice = std::ranges::unique(edges_, {}, key);
  edges_.erase(twice.begin(), twice.end());
  seen_.assign(edges_.size(), 0);

  double x1 = -HUGE_VAL, y1 = -HUGE_VAL;
  x0_ = y0_ = HUGE_VAL;
  for (const Vec3& v : mesh.vertices) {
    x0_ = std::min(x0_, v.x), x1 = std::max(x1, v.x);
    y0_ = std::min(y0_, v.y), y1 = std::max(y1, v.y);
  }
  cells_ = std::clamp(int(std::sqrt(double(mesh.triangles.size()))), 1, kMostCells);
  per_cell_x_ = std::max((x1 - x0_) / cells_, 1e-300);
  per_cell_y_ = std::max((y1 - y0_) / cells_, 1e-300);

  const auto cell_of = [&](const Vec3& v) {
    return std::size_t(cell(v.y, y0_, per_cell_y_)) * cells_ + cell(v.x, x0_, per_cell_x_);
  };
  first_vertex_.assign(std::size_t(cells_) * cells_ + 1, 0);
  vertices_ = mesh.vertices;
  std::ranges::stable_sort(vertices_, {}, cell_of);
  for (const Vec3& v : vertices_) ++first_vertex_[cell_of(v) + 1];
  sum_up(first_vertex_);

  const auto each_cell_of = [&](const Edge& e, auto&& f) {
    each_row({e.from, e.to, e.to}, [&](std::size_t first, std::size_t last) {
      for (std::size_t in = first; in <= last; ++in) f(in);
    });
  };
  first_edge_.assign(first_vertex_.size(), 0);
  for (const Edge& e : edges_) each_cell_of(e, [&](std::size_t in) { ++first_edge_[in + 1]; });
  sum_up(first_edge_);
  edge_.resize(first_edge_.back());
  std::vector<std::uint32_t> next(first_edge_.begin(), first_edge_.end() - 1);
  for (std::uint32_t e = 0; e < edges_.size(); ++e)
    each_cell_of(edges_[e], [&](std::size_t in) { edge_[next[in]++] = e; });
}

double MeshDeviation::of(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double area = orient2d(a, b, c);
  double worst = 0;
  each_vertex(a, b, c, [&](const Vec3& v) {
    const double wb = orient2d(v, c, a) / area, wc = orient2d(v, a, b) / area;
    const double z = a.z + (wb * (b.z - a.z) + wc * (c.z - a.z));
    worst = std::max(worst, std::fabs(z - v.z));
  });
  for (const auto& [s, t] : {std::pair{&a, &b}, {&b, &c}, {&c, &a}}) {
    each_crossing(*s, *t, [&](const Vec3& v, double share) {
      worst = std::max(worst, std::fabs(s->z + share * (t->z - s->z) - v.z));
    });
  }
  return worst;
}

}  // namespace tind
