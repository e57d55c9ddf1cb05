// A complete tree: the triangles of a node are halved by the median of their boxes' middles, along
// the axis on which these are spread widest, so nothing but the boxes is stored.

#include "terrain/mesh/triangle_tree.h"

#include <limits>

namespace tind {

namespace {

constexpr std::size_t kLeaf = 4;

}  // namespace

PlaneBox box_of(const Tin& tin, const Triangle& t) {
  const Vec3 &a = tin.vertices[t[0]], &b = tin.vertices[t[1]], &c = tin.vertices[t[2]];
  return {{std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y})},
          {std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y})}};
}

TriangleTree::TriangleTree(const Tin& tin) : tin_(tin), order_(tin.triangles.size()) {
  for (std::uint32_t t = 0; t < order_.size(); ++t) order_[t] = t;
  while ((kLeaf << levels_) < order_.size()) ++levels_;
  nodes_.resize((std::size_t(2) << levels_) - 1);
  build(0, 0, order_.size(), 0);
}

void TriangleTree::build(std::size_t node, std::size_t begin, std::size_t end, int level) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  PlaneBox box{{kFar, kFar}, {-kFar, -kFar}}, middles = box;
  const auto take = [](PlaneBox& b, const Vec2& low, const Vec2& high) {
    b.low = {std::min(b.low.x, low.x), std::min(b.low.y, low.y)};
    b.high = {std::max(b.high.x, high.x), std::max(b.high.y, high.y)};
  };
  const auto middle_of = [&](std::uint32_t t) {
    const PlaneBox b = box_of(tin_, tin_.triangles[t]);
    return Vec2{b.low.x / 2 + b.high.x / 2, b.low.y / 2 + b.high.y / 2};
  };
  for (std::size_t i = begin; i < end; ++i) {
    const PlaneBox b = box_of(tin_, tin_.triangles[order_[i]]);
    take(box, b.low, b.high);
    take(middles, middle_of(order_[i]), middle_of(order_[i]));
  }
  nodes_[node] = box;
  if (level == levels_ || begin == end) return;
  const bool x = middles.high.x - middles.low.x >= middles.high.y - middles.low.y;
  const std::size_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + std::ptrdiff_t(begin), order_.begin() + std::ptrdiff_t(middle),
                   order_.begin() + std::ptrdiff_t(end), [&](std::uint32_t s, std::uint32_t t) {
                     const Vec2 p = middle_of(s), q = middle_of(t);
                     const double a = x ? p.x : p.y, b = x ? q.x : q.y;
                     return a != b ? a < b : s < t;
                   });
  build(2 * node + 1, begin, middle, level + 1);
  build(2 * node + 2, middle, end, level + 1);
}

}  // namespace tind
