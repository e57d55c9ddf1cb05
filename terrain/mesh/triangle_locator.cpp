#include "terrain/mesh/triangle_locator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tind {
namespace {

/// A share of a triangle's area: what rounding may take from a place on its edge.
constexpr double kOnEdge = 1e-9;

struct Box {
  Vec2 low, high;
};

Box box_of(const Tin& mesh, const Triangle& t) {
  Box box{{mesh.vertices[t[0]].x, mesh.vertices[t[0]].y}, {}};
  box.high = box.low;
  for (const std::uint32_t v : t) {
    const Vec3& p = mesh.vertices[v];
    box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y)};
    box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y)};
  }
  return box;
}

}  // namespace

TriangleLocator::TriangleLocator(const Tin& mesh) : mesh_(&mesh) {
  if (mesh.triangles.empty()) return;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec2 high{-kInfinity, -kInfinity};
  low_ = {kInfinity, kInfinity};
  for (const Vec3& p : mesh.vertices) {
    low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  const auto per_unit = [&](double span) { return span > 0 ? side_ / span : 0; };
  struct Squares {
    int west, south, east, north;
    std::uint64_t count() const {
      return std::uint64_t(east - west + 1) * std::uint64_t(north - south + 1);
    }
  };
  const auto squares_of = [&](const Triangle& t) -> Squares {
    const Box box = box_of(mesh, t);
    return {square(box.low.x, low_.x, squares_per_unit_.x),
            square(box.low.y, low_.y, squares_per_unit_.y),
            square(box.high.x, low_.x, squares_per_unit_.x),
            square(box.high.y, low_.y, squares_per_unit_.y)};
  };
  // Long triangles are in many squares: no more of them than there is memory in proportion for.
  constexpr std::uint64_t kMostEntries = 16;  // a triangle, in the mean
  side_ = std::clamp(int(std::sqrt(double(mesh.triangles.size()))), 1, 1024);
  for (;; side_ /= 2) {
    squares_per_unit_ = {per_unit(high.x - low_.x), per_unit(high.y - low_.y)};
    std::uint64_t entries = 0;
    for (const Triangle& t : mesh.triangles) entries += squares_of(t).count();
    if (side_ == 1 || entries <= kMostEntries * mesh.triangles.size()) break;
  }

  // Twice over the triangles: how many in each square, then which.
  first_.assign(std::size_t(side_) * side_ + 1, 0);
  const auto each = [&](auto&& visit) {
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const Squares in = squares_of(mesh.triangles[t]);
      for (int y = in.south; y <= in.north; ++y)
        for (int x = in.west; x <= in.east; ++x) visit(std::size_t(y) * side_ + x, t);
    }
  };
  each([&](std::size_t s, std::uint32_t) { ++first_[s + 1]; });
  for (std::size_t s = 1; s < first_.size(); ++s) first_[s] += first_[s - 1];
  list_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  each([&](std::size_t s, std::uint32_t t) { list_[next[s]++] = t; });
}

int TriangleLocator::square(double x, double low, double per_unit) const {
  return std::clamp(int((x - low) * per_unit), 0, side_ - 1);
}

std::optional<double> TriangleLocator::height_at(Vec2 place) const {
  if (first_.empty()) return {};
  const std::size_t s = std::size_t(square(place.y, low_.y, squares_per_unit_.y)) * side_ +
                        square(place.x, low_.x, squares_per_unit_.x);
  const Vec3 p{place.x, place.y, 0};
  for (std::uint32_t i = first_[s]; i < first_[s + 1]; ++i) {
    const Triangle& t = mesh_->triangles[list_[i]];
    const Vec3 &a = mesh_->vertices[t[0]], &b = mesh_->vertices[t[1]], &c = mesh_->vertices[t[2]];
    const double area = orient2d(a, b, c);
    const std::array shares = {orient2d(b, c, p) / area, orient2d(c, a, p) / area,
                               orient2d(a, b, p) / area};
    if (std::ranges::all_of(shares, [](double share) { return share >= -kOnEdge; }))
      return shares[0] * a.z + shares[1] * b.z + shares[2] * c.z;
  }
  return {};
}

}  // namespace tind
