// The tree is complete: its triangles are halved by the median along one axis, level by level, so
// node i's children are 2 i + 1 and 2 i + 2 and nothing else is stored. The axis is the one along
// which the box holds most of its triangles side by side: halves along the longest side overlap
// where triangles are as long as that, as on terrain that is steeper than wide.

#include "terrain/mesh/nearest.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace tind {

namespace {

constexpr std::size_t kLeaf = 4;

/// The nearest point of triangle abc (Ericson, Real-Time Collision Detection, 5.1.5).
NearestPoint nearest_on(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  auto at = [&](double u, double v, double w) {
    const Vec3 d = a * u + b * v + c * w - p;
    return NearestPoint{dot(d, d), 0, {u, v, w}};
  };
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return at(1, 0, 0);
  const Vec3 bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return at(0, 1, 0);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return at(1 - d1 / (d1 - d3), d1 / (d1 - d3), 0);
  const Vec3 cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return at(0, 0, 1);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return at(1 - d2 / (d2 - d6), 0, d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4, e = d4 - d3, f = d5 - d6;
  if (va <= 0 && e >= 0 && f >= 0 && e + f > 0) return at(0, 1 - e / (e + f), e / (e + f));
  const double sum = va + vb + vc;
  if (!(sum > 0)) return at(1, 0, 0);  // no area
  return at(1 - (vb + vc) / sum, vb / sum, vc / sum);
}

double component(const Vec3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

}  // namespace

NearestTriangle::NearestTriangle(const Tin& tin) : tin_(tin), order_(tin.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  while ((kLeaf << levels_) < order_.size()) ++levels_;
  nodes_.resize((std::size_t(2) << levels_) - 1);
  std::vector<Vec3> centres;
  centres.reserve(order_.size());
  for (const Triangle& t : tin.triangles)
    centres.push_back((tin.vertices[t[0]] + tin.vertices[t[1]] + tin.vertices[t[2]]) * (1.0 / 3));
  build(0, 0, order_.size(), 0, centres);
}

void NearestTriangle::build(std::size_t node, std::size_t begin, std::size_t end, int level,
                            std::vector<Vec3>& centres) {
  const auto lower = [](const Vec3& p, const Vec3& q) {
    return Vec3{std::min(p.x, q.x), std::min(p.y, q.y), std::min(p.z, q.z)};
  };
  const auto upper = [](const Vec3& p, const Vec3& q) {
    return Vec3{std::max(p.x, q.x), std::max(p.y, q.y), std::max(p.z, q.z)};
  };
  Box box{{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
  Vec3 extent;  // of all triangles, one after the other
  for (std::size_t i = begin; i < end; ++i) {
    const Triangle& t = tin_.triangles[order_[i]];
    const Vec3 &a = tin_.vertices[t[0]], &b = tin_.vertices[t[1]], &c = tin_.vertices[t[2]];
    const Vec3 low = lower(a, lower(b, c)), high = upper(a, upper(b, c));
    box.low = lower(box.low, low), box.high = upper(box.high, high);
    extent = extent + (high - low);
  }
  nodes_[node] = box;
  if (level == levels_) return;
  const Vec3 size = box.high - box.low;
  const auto side_by_side = [](double whole, double parts) {
    return whole > 0 ? whole / std::max(parts, 1e-9 * whole) : 0;
  };
  const double x = side_by_side(size.x, extent.x), y = side_by_side(size.y, extent.y);
  const double z = side_by_side(size.z, extent.z);
  const int axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
  const std::size_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + std::ptrdiff_t(begin), order_.begin() + std::ptrdiff_t(middle),
                   order_.begin() + std::ptrdiff_t(end), [&](std::uint32_t s, std::uint32_t t) {
                     const double a = component(centres[s], axis), b = component(centres[t], axis);
                     return a != b ? a < b : s < t;
                   });
  build(2 * node + 1, begin, middle, level + 1, centres);
  build(2 * node + 2, middle, end, level + 1, centres);
}

NearestPoint NearestTriangle::find(const Vec3& p, std::uint32_t hint) const {
  auto measure = [&](std::uint32_t t) {
    const Triangle& c = tin_.triangles[t];
    NearestPoint n = nearest_on(tin_.vertices[c[0]], tin_.vertices[c[1]], tin_.vertices[c[2]], p);
    n.triangle = t;
    return n;
  };
  NearestPoint best = measure(hint);
  auto away = [&](const Box& b) {
    const double x = std::max({b.low.x - p.x, 0.0, p.x - b.high.x});
    const double y = std::max({b.low.y - p.y, 0.0, p.y - b.high.y});
    const double z = std::max({b.low.z - p.z, 0.0, p.z - b.high.z});
    return x * x + y * y + z * z;
  };
  struct Entry {
    double squared;
    std::size_t node, begin, end;
    int level;
  };
  std::array<Entry, 64> stack;
  int n = 0;
  stack[n++] = {away(nodes_[0]), 0, 0, order_.size(), 0};
  while (n > 0) {
    const Entry e = stack[--n];
    if (e.squared > best.squared) continue;
    if (e.level == levels_) {
      for (std::size_t i = e.begin; i < e.end; ++i) {
        const NearestPoint m = measure(order_[i]);
        // Of equally near triangles the lowest, so that the hint does not decide.
        if (m.squared < best.squared || (m.squared == best.squared && m.triangle < best.triangle))
          best = m;
      }
      continue;
    }
    const std::size_t middle = e.begin + (e.end - e.begin) / 2;
    Entry left{away(nodes_[2 * e.node + 1]), 2 * e.node + 1, e.begin, middle, e.level + 1};
    Entry right{away(nodes_[2 * e.node + 2]), 2 * e.node + 2, middle, e.end, e.level + 1};
    if (left.squared < right.squared) std::swap(left, right);
    stack[n++] = left;  // the farther one waits
    stack[n++] = right;
  }
  return best;
}

}  // namespace tind
