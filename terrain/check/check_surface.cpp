// A quadtree of the tile's square; each leaf has the list of triangles that reach into it. (Cells
// of one size do not do: a coarse tile may have all its triangles in a corner.)

#include "terrain/check/check_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tind {

namespace {

constexpr double kEnd = 32767;

}  // namespace

TileSurface::TileSurface(const CheckedTile& tile) {
  triangles_.reserve(tile.triangles.size());
  for (const auto& t : tile.triangles) {
    Triangle triangle;
    for (std::size_t k = 0; k < 3; ++k)
      triangle[k] = {double(tile.u[t[k]]), double(tile.v[t[k]]), tile.height(t[k])};
    triangles_.push_back(triangle);
  }
  std::vector<std::uint32_t> all(triangles_.size());
  std::iota(all.begin(), all.end(), 0u);
  squares_.resize(1);
  divide(0, {0, 0, kEnd}, all, 0);
}

std::size_t TileSurface::bytes() const {
  return sizeof(Triangle) * triangles_.size() + sizeof(Square) * squares_.size() +
         4 * entries_.size() + 200;
}

bool TileSurface::reaches_into(const Triangle& t, const Place& square) {
  const double half = square.side / 2 + 0.01;  // a hair more, for posts on the sides of squares
  const double u = square.u + square.side / 2, v = square.v + square.side / 2;
  const auto apart = [half](double a, double b, double c, double centre) {
    return std::min({a, b, c}) > centre + half || std::max({a, b, c}) < centre - half;
  };
  if (apart(t[0].x, t[1].x, t[2].x, u) || apart(t[0].y, t[1].y, t[2].y, v)) return false;
  const auto beyond = [=](const Vec3& a, const Vec3& b) {
    const double du = b.x - a.x, dv = b.y - a.y;
    return du * (v - a.y) - dv * (u - a.x) + half * (std::abs(du) + std::abs(dv)) < 0;
  };
  return !beyond(t[0], t[1]) && !beyond(t[1], t[2]) && !beyond(t[2], t[0]);
}

void TileSurface::divide(std::size_t at, const Place& place,
                         const std::vector<std::uint32_t>& triangles, int depth) {
  constexpr std::size_t kFew = 6, kMany = 32, kMostEntries = 64;
  constexpr int kDeepest = 15;  // a square of one step of the tile's grid
  if (triangles.size() > kFew && depth < kDeepest) {
    const double side = place.side / 2;
    std::array<Place, 4> quarter;
    std::array<std::vector<std::uint32_t>, 4> inside;
    std::size_t sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      quarter[k] = {place.u + double(k & 1) * side, place.v + double(k >> 1) * side, side};
      for (const std::uint32_t t : triangles)
        if (reaches_into(triangles_[t], quarter[k])) inside[k].push_back(t);
      sum += inside[k].size();
    }
    // Around a vertex no square is small enough to part its triangles; those that lie on one
    // another all over the square no square parts, and a hostile tile has nothing else.
    const bool parts =
        sum < 4 * triangles.size() && entries_.size() < kMostEntries * (triangles_.size() + 64);
    if (parts && (sum < 2 * triangles.size() || triangles.size() > kMany)) {
      const std::size_t first = squares_.size();
      squares_[at] = {std::uint32_t(first), kDivided};
      squares_.resize(first + 4);
      for (std::size_t k = 0; k < 4; ++k) divide(first + k, quarter[k], inside[k], depth + 1);
      return;
    }
  }
  squares_[at] = {std::uint32_t(entries_.size()), std::uint32_t(triangles.size())};
  entries_.insert(entries_.end(), triangles.begin(), triangles.end());
}

std::optional<double> TileSurface::height_in(const Triangle& t, double u, double v) {
  const auto& [a, b, c] = t;
  constexpr double kOnEdge = -1e-5;  // a post on an edge is in both triangles, whatever rounding
  double wa = (b.x - u) * (c.y - v) - (b.y - v) * (c.x - u);
  double wb = (c.x - u) * (a.y - v) - (c.y - v) * (a.x - u);
  double wc = (a.x - u) * (b.y - v) - (a.y - v) * (b.x - u);
  if (wa < kOnEdge || wb < kOnEdge || wc < kOnEdge) return std::nullopt;
  wa = std::max(wa, 0.0), wb = std::max(wb, 0.0), wc = std::max(wc, 0.0);
  const double sum = wa + wb + wc;
  if (!(sum > 0)) return std::nullopt;
  return (wa * a.z + wb * b.z + wc * c.z) / sum;
}

std::optional<TileSurface::Gap> TileSurface::gap_at(double u, double v, double z) const {
  std::size_t at = 0;
  Place place{0, 0, kEnd};
  while (squares_[at].count == kDivided) {
    place.side /= 2;
    const bool right = u >= place.u + place.side, up = v >= place.v + place.side;
    place.u += right ? place.side : 0, place.v += up ? place.side : 0;
    at = squares_[at].first + std::size_t(right) + 2 * std::size_t(up);
  }
  std::optional<Gap> gap;
  const Square& square = squares_[at];
  for (std::uint32_t e = square.first; e < square.first + square.count; ++e) {
    const auto height = height_in(triangles_[entries_[e]], u, v);
    if (!height) continue;
    const double d = *height - z;
    gap = gap ? Gap{std::min(gap->low, d), std::max(gap->high, d)} : Gap{d, d};
  }
  return gap;
}

}  // namespace tind
