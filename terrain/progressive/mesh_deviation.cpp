#include "terrain/progressive/mesh_deviation.h"

#include <array>
#include <cmath>

namespace tind {

namespace {

constexpr int kMostCells = 96;  // a side

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
  const auto each_cell_of = [&](const Edge& e, auto&& f) {
    const auto [left, right] = std::minmax(e.from.x, e.to.x);
    const auto [low, high] = std::minmax(e.from.y, e.to.y);
    each_cell(left, right, low, high, f);
  };
  first_.assign(std::size_t(cells_ * cells_) + 1, 0);
  for (const Edge& e : edges_) each_cell_of(e, [&](std::size_t in) { ++first_[in + 1]; });
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  in_cell_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t e = 0; e < edges_.size(); ++e)
    each_cell_of(edges_[e], [&](std::size_t in) { in_cell_[next[in]++] = e; });
}

double MeshDeviation::of(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double area = orient2d(a, b, c);
  double worst = 0;
  each_extreme(a, b, c, [&](const Vec3& p) {
    const double wb = orient2d(p, c, a) / area, wc = orient2d(p, a, b) / area;
    const double z = a.z + (wb * (b.z - a.z) + wc * (c.z - a.z));
    worst = std::max(worst, std::fabs(z - p.z));
  });
  return worst;
}

}  // namespace tind
