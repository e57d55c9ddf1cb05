// The tile's square is cut into cells, each with the list of triangles that reach into it.

#include "terrain/pyramid/check_surface.h"

#include <algorithm>
#include <cmath>

namespace tind {

namespace {

constexpr double kEnd = 32767;

}  // namespace

TileSurface::TileSurface(const CheckedTile& tile) : triangles_(tile.triangles) {
  for (std::size_t i = 0; i < tile.u.size(); ++i)
    vertices_.push_back({double(tile.u[i]), double(tile.v[i]), tile.height(i)});
  cells_ = std::clamp(int(std::sqrt(double(triangles_.size()))), 1, 128);
  sort_into_cells();
}

std::size_t TileSurface::bytes() const {
  return 24 * vertices_.size() + 12 * triangles_.size() + 4 * entries_.size() + 4 * begin_.size() +
         200;
}

int TileSurface::cell_of(double x) const {
  return std::clamp(int(x / kEnd * cells_), 0, cells_ - 1);
}

template <class Visit>
void TileSurface::each_cell(std::uint32_t t, Visit&& visit) const {
  double low_u = kEnd, low_v = kEnd, high_u = 0, high_v = 0;
  for (const std::uint32_t i : triangles_[t]) {
    low_u = std::min(low_u, vertices_[i].x), high_u = std::max(high_u, vertices_[i].x);
    low_v = std::min(low_v, vertices_[i].y), high_v = std::max(high_v, vertices_[i].y);
  }
  // a hair more, for posts on cell boundaries
  for (int y = cell_of(low_v - 0.01); y <= cell_of(high_v + 0.01); ++y)
    for (int x = cell_of(low_u - 0.01); x <= cell_of(high_u + 0.01); ++x)
      visit(std::size_t(y) * std::size_t(cells_) + std::size_t(x));
}

void TileSurface::sort_into_cells() {
  begin_.assign(std::size_t(cells_) * std::size_t(cells_) + 1, 0);
  const auto count = std::uint32_t(triangles_.size());
  for (std::uint32_t t = 0; t < count; ++t)
    each_cell(t, [&](std::size_t cell) { ++begin_[cell + 1]; });
  for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
  entries_.resize(begin_.back());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t t = 0; t < count; ++t)
    each_cell(t, [&](std::size_t cell) { entries_[next[cell]++] = t; });
}

std::optional<double> TileSurface::height_in(const std::array<std::uint32_t, 3>& t, double u,
                                             double v) const {
  const Vec3 &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
  double wa = (b.x - u) * (c.y - v) - (b.y - v) * (c.x - u);
  double wb = (c.x - u) * (a.y - v) - (c.y - v) * (a.x - u);
  double wc = (a.x - u) * (b.y - v) - (a.y - v) * (b.x - u);
  constexpr double kOnEdge = -1e-5;  // a post on an edge is in both triangles, whatever rounding
  if (wa < kOnEdge || wb < kOnEdge || wc < kOnEdge) return std::nullopt;
  wa = std::max(wa, 0.0), wb = std::max(wb, 0.0), wc = std::max(wc, 0.0);
  const double sum = wa + wb + wc;
  if (!(sum > 0)) return std::nullopt;
  return (wa * a.z + wb * b.z + wc * c.z) / sum;
}

std::optional<TileSurface::Gap> TileSurface::gap_at(double u, double v, double z) const {
  std::optional<Gap> gap;
  const std::size_t cell = std::size_t(cell_of(v)) * std::size_t(cells_) + std::size_t(cell_of(u));
  for (std::uint32_t e = begin_[cell]; e < begin_[cell + 1]; ++e) {
    const auto height = height_in(triangles_[entries_[e]], u, v);
    if (!height) continue;
    const double d = *height - z;
    gap = gap ? Gap{std::min(gap->low, d), std::max(gap->high, d)} : Gap{d, d};
  }
  return gap;
}

}  // namespace tind
